#!/usr/bin/env python3
"""Puts nine instants of light_in_flight.xml into one picture, three by three.

Usage: python3 scenes/light_in_flight.py FLIGHT.npy STRIP.npy    (needs NumPy and Pillow)

Each shows one bin of the film, its brightest parts white, over the faint light of all bins, with its optical path
length in radii of the ball. A thin circle marks the ball, whose surface cannot be seen. The first frame has a scale bar.
"""

import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont

# Optical path lengths, of the film's 3 to 8.6; half the width of the picture, in radii of the ball.
INSTANTS, LOW, HIGH, HALF_WIDTH = (3.7, 4.4, 5.0, 5.7, 6.3, 6.7, 7.0, 7.4, 7.8), 3.0, 8.6, 2.1
GROUND, CIRCLE, GAP, TEXT = 0.08, 0.15, 4, 16


def written(length: float, bar: bool) -> np.ndarray:
    """Returns an optical path length in the upper left corner of a frame, from 0 to 1. If `bar`, adds a scale bar in the lower right corner."""
    sheet = Image.new("L", (columns, rows))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(TEXT)
    draw.text((TEXT // 2, TEXT // 4), f"{length} radii", 255, font)
    if bar:
        radius, right, low = columns / (2 * HALF_WIDTH), columns - TEXT // 2, rows - TEXT // 2
        draw.line((right - radius, low, right, low), 255, 2)
        draw.text((right - radius / 2, low - 3), "1 radius", 255, font, anchor="mb")
    return np.asarray(sheet) / 255


flight = np.load(sys.argv[1])[..., 0]
rows, columns, bins = flight.shape
step = (HIGH - LOW) / bins
x = (np.arange(columns) + 0.5) / columns * 2 * HALF_WIDTH - HALF_WIDTH
y = (np.arange(rows)[:, None] + 0.5 - rows / 2) / columns * 2 * HALF_WIDTH
pixels = np.abs(np.hypot(x, y) - 1) * columns / (2 * HALF_WIDTH)

ground = flight.sum(2)
ground *= GROUND / np.percentile(ground, 95)
frames = []
for instant in INSTANTS:
    front = flight[:, :, round((instant - LOW) / step)]
    frame = ground + front / np.percentile(front[front > 0], 90) + CIRCLE * np.clip(1 - pixels, 0, 1) + written(instant, instant == INSTANTS[0])
    frames.append(np.pad(np.minimum(frame, 1), ((0, GAP), (0, GAP)), constant_values=1))
strip = np.vstack([np.hstack(frames[i : i + 3]) for i in (0, 3, 6)])[:-GAP, :-GAP]
np.save(sys.argv[2], strip.astype(np.float32))
