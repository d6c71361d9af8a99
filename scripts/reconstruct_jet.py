"""Reconstructs a jet from exit directions and positions of rays, with the rays as they are and as if they were straight: errors and CPU seconds.

    target/python-venv/bin/python scripts/reconstruct_jet.py --views 16 --pixels 64 --samples 64 --noise 0.01
"""

import argparse
import resource

import numpy as np
from morgana import grad, reconstruct

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
AMBIENT = 1.0
CALIBRATION = 1e-4
"""Contrasts are multiplied by this, and deflections divided, for rays that are straight to first order."""


def jet(samples, contrast, smooth):
    """n, [z, y, x], of a jet that spreads and meanders, with eddies that jump on its axis unless they are smooth. It fades towards the faces of the box."""
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, samples)], indexing="ij")
    width = 0.16 + 0.1 * (z + 1)
    x, y = x - 0.12 * np.sin(4 * z + 0.5), y - 0.1 * np.cos(5 * z)
    radius = np.hypot(x, y)
    strength = 0.35 * (1 - np.exp(-((radius / 0.12) ** 3))) if smooth else 0.35
    eddies = 1 + strength * np.sin(9 * z + 3 * np.arctan2(y, x)) * np.sin(11 * radius + 2 * z)
    core = np.exp(-((radius / width) ** 2)) * eddies
    return AMBIENT + contrast * core / np.abs(core).max() * np.clip(1.5 * (1 - z**2), 0, 1) ** 2


def views(count, pixels):
    """Parallel rays around the axis of the jet, half a turn."""
    across = np.linspace(-0.95, 0.95, pixels)
    u, w = (a.ravel() for a in np.meshgrid(across, across))
    angles = np.pi * np.arange(count) / count
    along = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    side = np.column_stack([-np.sin(angles), np.cos(angles), 0 * angles])
    origins = side[:, None] * u[None, :, None] + np.array([0, 0, 1]) * w[None, :, None] - 2 * along[:, None]
    return origins.reshape(-1, 3), np.repeat(along, pixels**2, axis=0)


def figure(path, true, found, deflection):
    """What the first camera sees, and cuts through the jet and what was found of it. `deflection` [row, column] is sideways, in radians."""
    import matplotlib.pyplot as plt

    middle = len(true) // 2
    cuts = [(1e3 * (index[:, middle] - AMBIENT), name) for index, name in [(true, "the jet"), (found, "found")]]
    largest = np.abs(deflection).max() * 1e3
    fig, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained", sharey=True)
    for ax, (values, name) in zip(axes[1:], cuts):
        drawn = ax.imshow(values, origin="lower", extent=[-1, 1, -1, 1], cmap="magma", vmin=0, vmax=cuts[0][0].max())
        ax.set(title=f"{name}, in the plane y = 0", xlabel="x")
    fig.colorbar(drawn, ax=list(axes[1:]), label="1000 (n − 1)")
    drawn = axes[0].imshow(1e3 * deflection, origin="lower", extent=[-1, 1, -1, 1], cmap="RdBu", vmin=-largest, vmax=largest)
    axes[0].set(title="measured by the first camera", xlabel="y", ylabel="z")
    fig.colorbar(drawn, ax=axes[0], label="sideways deflection, mrad")
    fig.savefig(path, dpi=100)


def cpu():
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


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

    origins, directions = views(given.views, given.pixels)
    true = jet(given.samples, given.contrast, given.smooth)
    # The data are of a finer grid, and of a tighter tolerance.
    ends = grad.Rays(origins, directions, box=BOX, ambient=AMBIENT, tolerance=1e-6).forward(jet(given.samples * 3 // 2, given.contrast, given.smooth))
    rays = grad.Rays(origins, directions, box=BOX, ambient=AMBIENT, tolerance=given.tolerance)
    undisturbed = rays.forward(np.full((4, 4, 4), AMBIENT))
    rng = np.random.default_rng(0)
    measured, noise = {}, {}
    for name in ("positions", "directions"):
        moved = getattr(ends, name) - getattr(undisturbed, name)
        noise[name] = max(given.noise, 1e-3) * np.sqrt(np.mean(np.sum(moved**2, axis=1)) / 2)
        across = rng.normal(size=moved.shape)
        across -= np.sum(across * directions, axis=1, keepdims=True) * directions
        measured[name] = moved + given.noise / max(given.noise, 1e-3) * noise[name] * across

    walls = np.zeros(true.shape, bool)
    walls[:, [0, -1]] = walls[:, :, [0, -1]] = True

    def fit(scale):
        """With all contrasts and deflections multiplied by `scale`."""
        options = {name: getattr(undisturbed, name) + scale * measured[name] for name in measured}
        before = cpu()
        found = reconstruct.fit(
            rays,
            true.shape,
            **options,
            position_noise=scale * noise["positions"],
            direction_noise=scale * noise["directions"],
            known=walls,
            iterations=given.iterations,
            progress=lambda now: print(f"  {now.shape[0]}³, iteration {now.number}: χ² {now.chi_square:.4g}, {cpu() - before:.1f} s", flush=True),
        )
        index = AMBIENT + (found.samples - AMBIENT) / scale
        error = np.linalg.norm(index**2 - true**2) / np.linalg.norm(true**2 - AMBIENT**2)
        print(f"{found!r}: relative error of n² − n_r² {error:.4f}, {cpu() - before:.1f} CPU s")
        return index

    deflected = np.linalg.norm(ends.directions - undisturbed.directions, axis=1)
    print(f"{len(rays)} rays, deflected by {deflected.max():.3g} rad at most; peak memory so far {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    print("straight rays" if given.straight else "curved rays")
    found = fit(CALIBRATION if given.straight else 1.0)
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    if given.figure:
        figure(given.figure, true, found, measured["directions"][: given.pixels**2, 1].reshape(given.pixels, given.pixels))


if __name__ == "__main__":
    main()
