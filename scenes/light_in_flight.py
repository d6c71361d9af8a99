#!/usr/bin/env python3
"""Puts nine instants of light_in_flight.xml into one picture, three by three.

Usage: python3 scenes/light_in_flight.py FLIGHT.npy STRIP.npy    (needs NumPy and Pillow)

Each shows one bin of the film, its brightest parts white, over the faint light of all bins, with its optical path
length. A thin circle marks the ball, whose surface cannot be seen.
"""

import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont

# Optical path lengths, of the film's 3 to 8.6; half the width of the picture, in radii of the ball.
INSTANTS, LOW, HIGH, HALF_WIDTH = (3.7, 4.4, 5.0, 5.7, 6.3, 6.7, 7.0, 7.4, 7.8), 3.0, 8.6, 2.1
GROUND, CIRCLE, GAP, TEXT = 0.08, 0.15, 4, 18


def written(text: str) -> np.ndarray:
    """Returns a text in the upper left corner of a frame, from 0 to 1."""
    sheet = Image.new("L", (columns, rows))
    ImageDraw.Draw(sheet).text((TEXT // 2, TEXT // 3), text, 255, ImageFont.load_default(TEXT))
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
    frame = ground + front / np.percentile(front[front > 0], 90) + CIRCLE * np.clip(1 - pixels, 0, 1) + written(f"{instant}")
    frames.append(np.pad(np.minimum(frame, 1), ((0, GAP), (0, GAP)), constant_values=1))
strip = np.vstack([np.hstack(frames[i : i + 3]) for i in (0, 3, 6)])[:-GAP, :-GAP]
np.save(sys.argv[2], strip.astype(np.float32))
