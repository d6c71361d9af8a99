#!/usr/bin/env python3
"""Draws figures of the guides that no command of a guide writes. Needs the package morgana and Matplotlib.

Usage: scripts/guide_figures.py [NAME ...]

A NAME is a figure in docs/images/guides without its ending; by default, all of FIGURES.
"""

import argparse
import ast
import math
import os
import re
import sys
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import morgana
import morgana.plot
import morgana.schlieren
import morgana.speckle
import numpy as np
import panels
from matplotlib.colors import LogNorm

ROOT = Path(__file__).resolve().parents[1]


def functions(page):
    """Returns the functions that the programs of a page define, by their names."""
    found = {}
    for block in re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE):
        kept = [node for node in ast.parse(block).body if isinstance(node, (ast.Import, ast.ImportFrom, ast.FunctionDef))]
        exec(compile(ast.Module(kept, []), page, "exec"), found)
    return found


def program(page):
    """Runs the programs of a page. Returns their namespace."""
    found = {}
    for block in re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE):
        exec(compile(block, page, "exec"), found)
    return found


def program_until(page, name):
    """Runs the block of a page that assigns a name. Returns the namespace of this block."""
    for block in re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE):
        if re.search(rf"^{name} = ", block, re.MULTILINE):
            found = {"morgana": morgana, "np": np}
            exec(compile(block, page, "exec"), found)
            return found
    sys.exit(f"{page} has no block that assigns {name}")


def bos_pair():
    """Dots behind a jet, and their displacement (docs/guides/schlieren.md)."""
    pair = morgana.schlieren.bos(str(ROOT / "scenes/bos_jet.xml"), spp=8, rays=2, seed=1)
    rows, columns = pair.flow.shape[:2]
    fig, axes = plt.subplots(1, 3, figsize=(9.6, 4.6), layout="constrained", sharey=True)
    axes[0].imshow(pair.flow[..., 0], cmap="gray", extent=[0, columns, rows, 0])
    axes[0].set(title="with the jet", ylabel="row (pixels)")
    for axis, title in enumerate(["displacement to the right", "displacement downwards"]):
        drawn = axes[1 + axis].imshow(pair.displacement[..., axis], cmap="RdBu", vmin=-1, vmax=1, extent=[0, columns, rows, 0])
        axes[1 + axis].set_title(title)
    for ax in axes:
        ax.set_xlabel("column (pixels)")
    fig.colorbar(drawn, ax=axes[1:], label="displacement (pixels)")
    return fig


def shimmering_air():
    """Squares behind turbulent air, and their displacement (docs/guides/schlieren.md)."""
    frames = [0, 4, 8]
    pairs = [morgana.schlieren.bos(str(ROOT / "scenes/shimmering_air.xml"), parameters={"frame": frame}, spp=8, rays=2, seed=1) for frame in frames]
    rows, columns = pairs[0].flow.shape[:2]
    largest = max(np.abs(pair.displacement[..., 0]).max() for pair in pairs)
    fig, axes = plt.subplots(2, 3, figsize=(9.6, 4.6), layout="constrained", sharex=True, sharey=True)
    for ax, below, frame, pair in zip(axes[0], axes[1], frames, pairs):
        ax.imshow(pair.flow[..., 0], cmap="gray", extent=[0, columns, rows, 0])
        ax.set_title(f"frame {frame}")
        drawn = below.imshow(pair.displacement[..., 0], cmap="RdBu", vmin=-largest, vmax=largest, extent=[0, columns, rows, 0])
        below.set_xlabel("column (pixels)")
    for ax in axes[:, 0]:
        ax.set_ylabel("row (pixels)")
    fig.colorbar(drawn, ax=axes[1], label="displacement to\nthe right (pixels)")
    return fig


def two_points():
    """Images of two points through open and obscured apertures (docs/guides/coherence.md)."""
    seen = functions("docs/guides/coherence.md")["seen"]
    fig, axes = plt.subplots(1, 4, figsize=(9.6, 2.7), layout="constrained", sharey=True)
    for pair, obscuration, name in [(axes[:2], 0.0, "open"), (axes[2:], 0.5, "obscured")]:
        image = np.sqrt(seen(spp=8000, pixels=32, obscuration=obscuration))
        for ax, channel, light in [(pair[0], 0, "450 nm"), (pair[1], 1, "650 nm")]:
            drawn = ax.imshow(image[..., channel] / image[..., channel].max(), cmap="magma", vmin=0, vmax=1, extent=[-12, 12, -12, 12])
            ax.set(title=f"{light}, {name}", xlabel="x (µm)")
    axes[0].set_ylabel("y (µm)")
    fig.colorbar(drawn, ax=axes, label="√(brightness / largest)")
    return fig


def points_of_rays(side, seed, **aperture):
    """Returns x and y in the focal plane, in µm, of the rays from one point of a diffracting sensor. `side`² rays start at the sensor."""
    scene = {
        "type": "scene",
        "integrator": {"type": "aov", "aovs": "position"},
        "sensor": {
            "type": "telecentric",
            "acceptance_angle": math.degrees(math.asin(0.05)),
            "focus_distance": 1,
            "diffraction": True,
            "metres_per_unit": 1e-3,
            **aperture,
            "to_world": [{"scale": [1e-9, 1e-9, 1]}],
            "film": {"type": "hdrfilm", "width": side, "height": side, "pixel_format": "spectral", "wavelengths": "550", "rfilter": {"type": "box"}},
        },
        "plane": {"type": "rectangle", "to_world": [{"translate": [0, 0, 1]}], "bsdf": {"type": "diffuse"}},
    }
    places = morgana.render(morgana.load_dict(scene), spp=1, seed=seed).layers["position"].mean
    return 1e3 * places[..., 0].ravel(), 1e3 * places[..., 1].ravel()


def stars():
    """Images of a point through a polygon and through vanes (docs/guides/coherence.md)."""
    apertures = {
        "six straight blades": {"blades": 6},
        "covered middle and four vanes": {"obscuration": 0.3, "vanes": 4, "vane_width": 0.15},
    }
    half, pixels = 40, 80
    fig, axes = plt.subplots(1, 2, figsize=(8, 3.8), layout="constrained", sharey=True)
    for ax, (name, aperture) in zip(axes, apertures.items()):
        counts = np.zeros((pixels, pixels))
        for seed in range(4):
            x, y = points_of_rays(1500, seed, **aperture)
            counts += np.histogram2d(y, x, bins=pixels, range=[[-half, half]] * 2)[0]
        drawn = ax.imshow(counts / counts.max(), origin="lower", cmap="gray", norm=LogNorm(1e-4, 1), extent=[-half, half, -half, half])
        ax.set(title=name, xlabel="x (µm)")
        ax.set_facecolor("black")
    axes[0].set_ylabel("y (µm)")
    fig.colorbar(drawn, ax=axes, label="brightness relative to the peak")
    return fig


def speckle_pattern():
    """A speckle pattern and the distribution of its intensities (docs/guides/tissue-optics.md)."""
    scene = {
        "type": "scene",
        "integrator": {"type": "particle"},
        "layer": {
            "type": "cube",
            "bsdf": {"type": "null"},
            "to_world": [{"scale": [2, 2, 0.05]}, {"translate": [0, 0, 0.05]}],
            "interior": {"type": "homogeneous", "sigma_s": 60, "sigma_a": 0.1, "phase": {"type": "hg", "g": 0.8}},
        },
        "laser": {"type": "collimated", "radius": 0.04, "power": 1, "to_world": [{"translate": [0, 0, -1]}]},
        "plane": {
            "type": "disk",
            "bsdf": {"type": "null"},
            "to_world": [{"scale": 0.05}, {"translate": [0, 0, 0.11]}],
            "lens": {"type": "irradiancemeter", "id": "lens", "records": True, "numerical_aperture": 0.2},
        },
    }
    lens = morgana.render(morgana.load_dict(scene), particles=1_000_000, seed=1).records["lens"]
    seen = morgana.speckle.pattern(lens, (64, 64), 0.75e-3, wavelength=633e-6, numerical_aperture=0.2, center=(0, 0, 0.11))
    bright = seen.intensity / seen.intensity.mean()
    fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.2), layout="constrained")
    drawn = left.imshow(bright, cmap="magma", vmin=0, extent=[-24, 24, -24, 24], origin="lower")
    left.set(xlabel="x (µm)", ylabel="y (µm)")
    fig.colorbar(drawn, ax=left, label="intensity relative to the mean")
    right.hist(bright.ravel(), bins=np.arange(0, 8.25, 0.25), density=True, log=True, label="pixels")
    values = np.linspace(0, 8)
    right.plot(values, np.exp(-values), label="negative exponential")
    right.set(xlabel="intensity relative to the mean", ylabel="probability density", ylim=(3e-4, 1.5))
    right.legend()
    return fig


def tagged_fluence():
    """All light in tissue, and the light that ultrasound tags (docs/guides/acousto-optics.md)."""
    meters = functions("docs/guides/acousto-optics.md")["tagged_map"](1_000_000, 64, 64)
    maps = {"all light": meters["fluence"].mean[:, 0], "first sidebands": 2 * meters["fluence_sidebands"].mean[1, :, 0]}
    fig, axes = plt.subplots(1, 2, figsize=(9.6, 4.2), layout="constrained", sharey=True)
    for ax, (name, fluence) in zip(axes, maps.items()):
        drawn = ax.imshow(np.squeeze(fluence), origin="lower", cmap="magma", norm=LogNorm(1e-4, 1), extent=[-5, 5, -5, 5])
        ax.set(title=name, xlabel="x (mm)")
    axes[0].set_ylabel("z (mm)")
    fig.colorbar(drawn, ax=axes, label="fluence rate per watt (1/mm²)", extend="both")
    return fig


def frequency_domain_absorbers():
    """Absorption of a block with two balls, true and reconstructed (docs/guides/frequency-domain.md)."""
    page = program("docs/guides/frequency-domain.md")
    fig, axes = plt.subplots(2, 3, figsize=(8.6, 5.4), layout="constrained", sharex=True, sharey=True)
    angle = np.linspace(0, 2 * np.pi, 200)
    for row, values, name in zip(axes, (page["truth"], page["found"].reshape(page["cells"])), ("true", "found")):
        for layer, ax in enumerate(row):
            drawn = ax.imshow(values[layer], origin="lower", extent=[0, 28, 0, 28], cmap="viridis", vmin=0, vmax=0.04)
            ax.set(title=f"{name}, depth {4 * layer} to {4 * layer + 4} mm", xticks=range(0, 29, 7), yticks=range(0, 29, 7))
            for x, y, z in page["balls"]:
                # A ball is drawn in each layer that it enters, with its radius in the middle of the layer.
                radius = np.sqrt(max(4**2 - (4 * layer + 2 - z) ** 2, 0))
                if radius > 0:
                    ax.plot(x + radius * np.cos(angle), y + radius * np.sin(angle), "w--", linewidth=1.2)
    for ax in axes[:, 0]:
        ax.set_ylabel("y (mm)")
    for ax in axes[1]:
        ax.set_xlabel("x (mm)")
    fig.colorbar(drawn, ax=axes, label="absorption coefficient (1/mm)", shrink=0.8)
    return fig


def mueller_maps():
    """Mueller matrix of backscattered light around a beam (docs/guides/tissue-optics.md)."""
    page = functions("docs/guides/tissue-optics.md")
    page["filters"] = [{"type": "polarizer", "theta": theta} for theta in (0, 90, 45)] + [{"type": "circular"}]
    maps = page["mueller"](particles=400_000, pixels=25)
    fig, axes = plt.subplots(4, 4, figsize=(9.0, 7.6), layout="constrained", sharex=True, sharey=True)
    place = {"origin": "lower", "extent": [-2, 2, -2, 2]}
    power = axes[0, 0].imshow(maps[0, 0] / 0.16**2, cmap="magma", norm=LogNorm(1e-3, 1), **place)
    for (row, column), ax in np.ndenumerate(axes):
        if row or column:
            drawn = ax.imshow(maps[row, column] / maps[0, 0], cmap="RdBu_r", vmin=-1, vmax=1, **place)
        ax.set_title(f"M{row + 1}{column + 1}", fontsize=10)
    fig.supxlabel("x (mm)")
    fig.supylabel("y (mm)")
    fig.colorbar(drawn, ax=axes[1:], label="element relative to M11")
    fig.colorbar(power, ax=axes[0], label="M11 (1/mm²)", extend="both")
    return fig


def cooke_triplet():
    """Layout, ray fans, spots and modulation of a lens (docs/guides/grin-design.md)."""
    triplet = program_until("docs/guides/grin-design.md", "triplet")["triplet"]
    fig, axes = plt.subplots(2, 3, figsize=(9.6, 5.8), layout="constrained")
    morgana.plot.lens(triplet, ax=axes[0, 0])
    for fans, spots, field in zip(axes[0, 1:], axes[1], triplet.fields[1:]):
        lines = morgana.plot.fan(triplet, field, ax=fans)
        fans.set_title(f"ray fan, {field:g}°")
        for line, wavelength, marker in zip(lines, triplet.wavelengths, "x.+"):
            spot = morgana.lens.trace(triplet, field, wavelength, count=8)
            spots.plot(*(1e3 * spot.points.T), marker, markersize=3, color=line.get_color())
        spots.set(title=f"spot, {field:g}°", xlabel="x (µm)", ylabel="y (µm)")
        spots.set_aspect("equal", adjustable="datalim")
    axes[0, 1].legend(loc="upper left")
    morgana.plot.modulation(triplet, frequencies=np.linspace(0, 100, 51), ax=axes[1, 2])
    axes[1, 2].legend()
    return fig


FIGURES = {figure.__name__: figure for figure in (bos_pair, shimmering_air, two_points, stars, speckle_pattern, tagged_fluence, frequency_domain_absorbers, mueller_maps, cooke_triplet)}


def save(fig, path):
    """Writes a figure with few colours."""
    panels.save_figure(fig, path)
    print(f"{path.relative_to(ROOT)}: {os.path.getsize(path)} bytes", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(FIGURES)} (default: all)")
    names = parser.parse_args().names or list(FIGURES)
    if unknown := set(names) - FIGURES.keys():
        sys.exit(f"no figure {', '.join(sorted(unknown))}; there are {', '.join(FIGURES)}")
    warnings.simplefilter("ignore", morgana.SceneWarning)
    for name in names:
        save(FIGURES[name](), ROOT / f"docs/images/guides/{name}.png")


if __name__ == "__main__":
    main()
