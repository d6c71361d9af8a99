#!/usr/bin/env python3
"""Writes shimmering_air.xml: turbulent hot air over a plate, as waves of random directions that rise, in a formula of position and time.

Usage: python3 scenes/shimmering_air.py    (needs numpy)
"""

from pathlib import Path

import numpy as np

MODES = 20
MIN_LENGTH, MAX_LENGTH = 0.08, 0.5  # metres
RISE = 0.3  # m/s
CONTRAST = -1.2e-4  # n − 1 against the air around of air at 250 °C, as on the plate

rng = np.random.default_rng(5)
length = np.geomspace(MAX_LENGTH, MIN_LENGTH, MODES)
k = 2 * np.pi / length
# A spectrum of 5/3: amplitudes of modes at equal steps of ln k fall as k^(-1/3).
amplitude = k ** (-1 / 3)
amplitude /= np.sqrt(0.5 * (amplitude**2).sum())
direction = rng.normal(size=(MODES, 3))
direction /= np.linalg.norm(direction, axis=1)[:, None]
phase = rng.uniform(0, 2 * np.pi, MODES)
# Eddies turn over while they rise, the small ones faster.
turn = rng.normal(size=MODES) * 2 * np.pi * 0.25 * (MAX_LENGTH / length) ** (2 / 3)

waves = " + ".join(
    f"{a:.3f}*cos({d[0] * m:.2f}*x + {d[1] * m:.2f}*h + {d[2] * m:.2f}*z + {w:.2f}*t + {p:.2f})"
    for a, m, d, w, p in zip(amplitude, k, direction, turn, phase)
).replace("+ -", "- ")
formula = f"1 + hot*(1 - y)^2*(1 - 4*z^2)^2*(1 + 0.5*({waves.replace('h', '(y - rise*t)')}))"

scene = f"""<scene version="3.0.0">
  <!--
    A board of squares, seen through turbulent hot air: made by shimmering_air.py. Frames of a sequence are a 24th of a second apart; the
    option "frames" renders several (docs/guides/schlieren.md):

      morgana render scenes/shimmering_air.xml -D frame=12 -o air.png

    Lengths are in metres.
  -->
  <default name="frame" value="0"/>
  <default name="hot" value="{CONTRAST:g}"/>
  <default name="spp" value="8"/>
  <default name="width" value="240"/>
  <default name="height" value="160"/>

  <!-- Lights in direct view are all that there is. -->
  <integrator type="path">
    <integer name="max_depth" value="1"/>
  </integrator>

  <sensor type="perspective">
    <float name="fov" value="1.6"/>
    <transform name="to_world">
      <lookat origin="0, 0.25, 10" target="0, 0.25, 0" up="0, 1, 0"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="$width"/>
      <integer name="height" value="$height"/>
      <string name="pixel_format" value="luminance"/>
    </film>
    <sampler type="independent">
      <integer name="sample_count" value="$spp"/>
    </sampler>
  </sensor>

  <medium id="air" type="transparent">
    <volume name="ior" type="expression">
      <string name="n" value="{formula.replace("*t", "*frame/24")}"/>
      <float name="hot" value="$hot"/>
      <float name="rise" value="{RISE:g}"/>
      <float name="frame" value="$frame"/>
    </volume>
  </medium>
  <shape id="box" type="cube">
    <transform name="to_world">
      <scale x="1" y="0.5" z="0.5"/>
      <translate y="0.5"/>
    </transform>
    <bsdf type="null"/>
    <ref name="interior" id="air"/>
  </shape>

  <shape id="board" type="rectangle">
    <transform name="to_world">
      <scale x="2" y="1"/>
      <translate y="0.25" z="-20"/>
    </transform>
    <bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
    <emitter type="area">
      <texture name="radiance" type="checkerboard">
        <float name="color0" value="0.1"/>
        <float name="color1" value="0.8"/>
        <transform name="to_uv"><scale x="20" y="10"/></transform>
      </texture>
    </emitter>
  </shape>
</scene>
"""
(Path(__file__).parent / "shimmering_air.xml").write_text(scene, encoding="utf-8")
