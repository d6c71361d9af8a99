"""Reconstructs a jet from exit directions and positions of rays, bent or straight: errors and CPU seconds.

The reconstruction traces rays as they are, or as if they were straight.

target/python-venv/bin/python scripts/reconstruct_jet.py --views 16 --pixels 64 --samples 64 --noise 0.01
target/python-venv/bin/python scripts/reconstruct_jet.py --views 64 --pixels 256 --samples 128 --noise 0.01
"""

import argparse
import resource

import numpy as np
from morgana import grad, reconstruct

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
AMBIENT = 1.0
CALIBRATION = 1e-4
"""Factor of contrasts, and divisor of deflections, for which rays are straight to first order."""


def jet(samples, contrast, smooth):
    """Returns n, [z, y, x], of a jet that spreads and meanders. Its eddies jump on its axis unless
    they are smooth. It fades towards the faces of the box."""
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, samples)], indexing="ij")
    width = 0.16 + 0.1 * (z + 1)
    x, y = x - 0.12 * np.sin(4 * z + 0.5), y - 0.1 * np.cos(5 * z)
    radius = np.hypot(x, y)
    strength = 0.35 * (1 - np.exp(-((radius / 0.12) ** 3))) if smooth else 0.35
    eddies = 1 + strength * np.sin(9 * z + 3 * np.arctan2(y, x)) * np.sin(11 * radius + 2 * z)
    core = np.exp(-((radius / width) ** 2)) * eddies
    return AMBIENT + contrast * core / np.abs(core).max() * np.clip(1.5 * (1 - z**2), 0, 1) ** 2


def _views(count, pixels):
    """Returns parallel rays around the axis of the jet, over half a turn."""
    origins, directions = [], []
    for angle in np.pi * np.arange(count) / count:
        place = (-2 * np.cos(angle), -2 * np.sin(angle), 0)
        camera = grad.Camera.look_at(place, (0, 0, 0), up=(0, 0, 1), width=1.9 * pixels / (pixels - 1), size=(pixels, pixels))
        # Begin below and on the right.
        starts = camera.rays(camera.pixels()[::-1, ::-1])
        origins.append(starts[0])
        directions.append(starts[1])
    return np.concatenate(origins), np.concatenate(directions)


def figure(path, true, found, deflection):
    """Draws the measurement of the first camera, and cuts through the jet and the result.
    `deflection` [row, column] is sideways, in radians."""
    import matplotlib.pyplot as plt
    import panels

    middle = len(true) // 2
    cuts = [(1e3 * (index[:, middle] - AMBIENT), name) for index, name in [(true, "the jet"), (found, "found")]]
    largest = np.abs(deflection).max() * 1e3
    fig, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained", sharey=True)
    for ax, (values, name) in zip(axes[1:], cuts):
        drawn = ax.imshow(values, origin="lower", extent=[-1, 1, -1, 1], cmap="magma", vmin=0, vmax=cuts[0][0].max())
        ax.set(title=f"{name}, in the plane y = 0", xlabel="x (halves of the box)")
    fig.colorbar(drawn, ax=list(axes[1:]), label="1000 (n − 1)")
    drawn = axes[0].imshow(1e3 * deflection, origin="lower", extent=[-1, 1, -1, 1], cmap="RdBu", vmin=-largest, vmax=largest)
    axes[0].set(title="measured by the first camera", xlabel="y (halves of the box)", ylabel="z (halves of the box)")
    fig.colorbar(drawn, ax=axes[0], label="sideways deflection (mrad)")
    panels.save_figure(fig, path)


def cpu():
    """Returns the seconds of all threads so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


class Problem:
    """A jet and its measurement by cameras. Noise is in units of the root mean square of the
    measured values."""

    def __init__(self, views=16, pixels=64, samples=64, contrast=0.03, noise=0.01, tolerance=1e-3, smooth=False):
        origins, directions = _views(views, pixels)
        self.true = jet(samples, contrast, smooth)
        # The data come from a finer grid and a tighter tolerance.
        self.ends = grad.Rays(origins, directions, box=BOX, ambient=AMBIENT, tolerance=1e-6).forward(jet(samples * 3 // 2, contrast, smooth))
        self.rays = grad.Rays(origins, directions, box=BOX, ambient=AMBIENT, tolerance=tolerance)
        self.undisturbed = self.rays.forward(np.full((4, 4, 4), AMBIENT))
        rng = np.random.default_rng(0)
        self.measured, self.noise = {}, {}
        for name in ("positions", "directions"):
            moved = getattr(self.ends, name) - getattr(self.undisturbed, name)
            self.noise[name] = max(noise, 1e-3) * np.sqrt(np.mean(np.sum(moved**2, axis=1)) / 2)
            across = rng.normal(size=moved.shape)
            across -= np.sum(across * directions, axis=1, keepdims=True) * directions
            self.measured[name] = moved + noise / max(noise, 1e-3) * self.noise[name] * across

    def fit(self, iterations=10, straight=False, progress=None):
        """Returns the reconstructed index, and its relative error of n² − n_r². Straight rays are
        rays of far smaller contrasts."""
        scale = CALIBRATION if straight else 1.0
        walls = np.zeros(self.true.shape, bool)
        walls[:, [0, -1]] = walls[:, :, [0, -1]] = True
        found = reconstruct.fit(
            self.rays,
            self.true.shape,
            **{name: getattr(self.undisturbed, name) + scale * moved for name, moved in self.measured.items()},
            position_noise=scale * self.noise["positions"],
            direction_noise=scale * self.noise["directions"],
            known=walls,
            iterations=iterations,
            progress=progress,
        )
        index = AMBIENT + (found.samples - AMBIENT) / scale
        return (found, index, np.linalg.norm(index**2 - self.true**2) / np.linalg.norm(self.true**2 - AMBIENT**2))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--views", type=int, default=16)
    parser.add_argument("--pixels", type=int, default=64, help="rays across each view")
    parser.add_argument("--samples", type=int, default=64, help="samples along each axis")
    parser.add_argument("--contrast", type=float, default=0.03)
    parser.add_argument("--noise", type=float, default=0.01, help="in units of the root mean square of what is measured")
    parser.add_argument("--tolerance", type=float, default=1e-3)
    parser.add_argument("--iterations", type=int, default=10, help="on each grid")
    parser.add_argument("--straight", action="store_true", help="as if rays were straight")
    parser.add_argument("--smooth", action="store_true", help="eddies that fade towards the axis")
    parser.add_argument("--figure", metavar="FILE", help="draw the first view, the jet, and what was found")
    given = parser.parse_args()

    problem = Problem(given.views, given.pixels, given.samples, given.contrast, given.noise, given.tolerance, given.smooth)
    deflected = np.linalg.norm(problem.ends.directions - problem.undisturbed.directions, axis=1)
    print(
        f"{len(problem.rays)} rays, deflected by {deflected.max():.3g} rad at most; peak memory so far {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB"
    )
    print("straight rays" if given.straight else "curved rays")
    before = cpu()
    tell = lambda now: print(f"  {now.shape[0]}³, {now.rays} rays, iteration {now.number}: χ² {now.chi_square:.4g}, {cpu() - before:.1f} s", flush=True)  # noqa: E731
    found, index, error = problem.fit(given.iterations, given.straight, tell)
    print(f"{found!r}: relative error of n² − n_r² {error:.4f}, {cpu() - before:.1f} CPU s")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    if given.figure:
        figure(given.figure, problem.true, index, problem.measured["directions"][: given.pixels**2, 1].reshape(given.pixels, given.pixels))


if __name__ == "__main__":
    main()
