"""Draws errors of reconstructions over iterations, views, contrast and noise, for the guide *Inverse problems*.

target/python-venv/bin/python scripts/reconstruction_errors.py docs/images/guides/reconstruction_errors.svg
"""

import argparse

import matplotlib.pyplot as plt
from reconstruct_jet import Problem

DEFAULTS = {"views": 16, "pixels": 24, "samples": 32, "contrast": 0.03, "noise": 0.01, "smooth": True}
ITERATIONS = [1, 2, 3, 5, 8, 12, 20]
PANELS = [
    ("views", [2, 4, 8, 16, 32], "views"),
    ("contrast", [3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.06], "Δn"),
    ("noise", [1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3], "noise over signal"),
]
MODELS = [("curved rays", False, "o-", "tab:blue"), ("straight rays", True, "s--", "tab:orange")]


def error(iterations=10, straight=False, **changed):
    found, _, value = Problem(**{**DEFAULTS, **changed}).fit(iterations, straight)
    print(f"{changed} {iterations} iterations, straight {straight}: error {value:.4f}, χ² {found.chi_square:.3g}, {found.stopped}", flush=True)
    return value


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    given = parser.parse_args()
    fig, axes = plt.subplots(1, 4, figsize=(13, 3.6), layout="constrained", sharey=True)
    for label, straight, style, color in MODELS:
        axes[0].plot(ITERATIONS, [error(count, straight) for count in ITERATIONS], style, color=color, label=label)
        for ax, (name, values, _) in zip(axes[1:], PANELS):
            ax.plot(values, [error(straight=straight, **{name: value}) for value in values], style, color=color)
    for ax, name in zip(axes, ["iterations on each grid", *(title for *_, title in PANELS)]):
        ax.set(xscale="log", yscale="log", xlabel=name)
        ax.grid(alpha=0.3, which="both")
    for ax, ticks in zip(axes, [ITERATIONS, PANELS[0][1]]):
        ax.set_xticks(ticks, labels=map(str, ticks))
        ax.minorticks_off()
    axes[0].set_yticks([0.05, 0.1, 0.2, 0.5], labels=["0.05", "0.1", "0.2", "0.5"])
    axes[0].set(ylabel="relative error of n² − n_r²")
    axes[0].legend()
    fig.savefig(given.file)


if __name__ == "__main__":
    main()
