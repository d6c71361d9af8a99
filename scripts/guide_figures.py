#!/usr/bin/env python3
"""Draws figures of the guides that no command of a guide writes. Needs the package morgana and Matplotlib.

Usage: scripts/guide_figures.py [NAME ...]

A NAME is a figure in docs/images/guides without its ending; by default, all of FIGURES.
"""

import argparse
import io
import os
import sys
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import morgana
import morgana.schlieren
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
COLOURS = 256


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


FIGURES = {"bos_pair": bos_pair}


def save(fig, path):
    """Writes a figure with few colours."""
    written = io.BytesIO()
    fig.savefig(written, dpi=100)
    Image.open(written).convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE).save(path, optimize=True)
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
