#!/usr/bin/env python3
"""Fits the quadratures of crates/eikonal/src/modulation/rule.rs to plane waves, and prints their numbers.

A rule integrates cos(κ(x − ½) + φ) over [0, 1] from values and derivatives at both ends and values
at inner positions, for every κ up to 2π times its longest panel in wavelengths. Its weights
minimise the largest error (linear programming). The polynomials that give the integral up to
positions on the panel minimise theirs likewise.

Needs NumPy and SciPy.
"""

import numpy as np
from scipy.optimize import linprog, minimize_scalar

# Longest panels in wavelengths, by the number of inner positions, without and with polynomials.
MAX_PANELS = [0.12, 0.5, 1.07, 1.77]
MAX_PANELS_WITHIN = [0.12, 0.5, 0.8]
DIGITS = 9


def least_error(columns, expected):
    """Returns the coefficients of columns whose sum is closest to the expected values, and the
    largest error."""
    bound = -np.ones((len(expected), 1))
    upper = np.block([[columns, bound], [-columns, bound]])
    cost = np.eye(columns.shape[1] + 1)[-1]
    free = [(None, None)] * columns.shape[1] + [(0, None)]
    found = linprog(cost, upper, np.concatenate([expected, -expected]), bounds=free)
    return found.x[:-1], found.x[-1]


def waves(longest, count=400):
    return np.linspace(1e-6, 2 * np.pi * longest, count)


def inner_places(offset, count):
    return [[], [0.5], [0.5 - offset, 0.5 + offset], [0.5 - offset, 0.5, 0.5 + offset]][count]


def fit_rule(longest, offset, count, slopes=True):
    """Returns weights of both ends, of the derivatives there, of a pair of inner positions and of
    the middle, and the error."""
    k = waves(longest)
    columns = [2 * np.cos(k / 2)]
    if slopes:
        columns.append(2 * k * np.sin(k / 2))
    if count >= 2:
        columns.append(2 * np.cos(k * offset))
    if count % 2:
        columns.append(np.ones_like(k))
    columns = np.array(columns).T
    weights, error = least_error(columns, 2 * np.sin(k / 2) / k)
    return weights, error, columns @ weights


def fit_within(longest, inner):
    """Returns coefficients of ∫₀ˣ over x for the known values, in the order of `Panel::tabulated`,
    and the error. At x = 0 it is the value there."""
    places = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 33))[1:]
    degree = 4 + len(inner)
    rows, expected = [], []
    for k in waves(longest, 26):
        wave = lambda x: np.exp(1j * k * (x - 0.5))
        known = [wave(0), 1j * k * wave(0), wave(1), 1j * k * wave(1), *map(wave, inner)]
        for x in places:
            row = np.outer(known, x ** np.arange(2, degree + 1)).ravel()
            integral = (wave(x) - wave(0)) / (1j * k) - x * wave(0)
            rows += [row.real, row.imag]
            expected += [integral.real, integral.imag]
    found, error = least_error(np.array(rows), np.array(expected))
    first = np.eye(degree)[:, :1]
    return np.hstack([first, found.reshape(degree, degree - 1)]), error


def main():
    for count, longest in enumerate(MAX_PANELS):
        offset = 0.0
        if count >= 2:
            fit = lambda offset: fit_rule(longest, offset, count)[1]
            offset = minimize_scalar(fit, bounds=(0.05, 0.4), method="bounded").x
            offset = round(offset, 4)
        weights, error, sums = fit_rule(longest, offset, count)
        plain, plain_error, plain_sums = fit_rule(longest, offset, count, slopes=False)
        print(f"{count} inner places {inner_places(offset, count)}, up to {longest}:")
        print(f"  ends, slopes, pair, middle {weights.round(DIGITS)}, error {error:.2g}")
        print(f"  without slopes {plain.round(DIGITS)}, error {plain_error:.2g}")
        print(f"  they differ by up to {np.abs(sums - plain_sums).max():.3g}")
        if count < len(MAX_PANELS_WITHIN):
            within, error = fit_within(MAX_PANELS_WITHIN[count], inner_places(offset, count))
            print(f"  within, up to {MAX_PANELS_WITHIN[count]}, error {error:.2g}:")
            for row in within.round(DIGITS):
                print("   ", ", ".join(f"{value:.{DIGITS}f}" for value in row))


if __name__ == "__main__":
    main()
