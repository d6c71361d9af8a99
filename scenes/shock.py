#!/usr/bin/env python3
"""Writes the data of shock.xml: the density around a diamond airfoil at Mach 2, and the airfoil as a mesh.

Usage: python3 scenes/shock.py                          (needs numpy)
       python3 scenes/shock.py fringes OPD.npy OUT.npy  makes fringes of path differences

The flow is that of shock-expansion theory, which is exact in all that the picture shows: oblique shocks
at the leading and at the trailing edge, and a Prandtl–Meyer fan at each shoulder, between regions of uniform
flow. Only farther out do shocks and fans meet.
"""

import struct
import sys
import zlib
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent

GAMMA, MACH, HALF_ANGLE = 1.4, 2.0, np.radians(10)
# Density of the flow ahead, kg/m³; chord, and depth of the tunnel along the line of sight, cm.
AHEAD, CHORD, DEPTH = 0.55, 5.0, 5.0
# Samples along x, y, z, and the corners of their box in cm.
SIZE = (320, 240, 7)
LOW, HIGH = np.array((-2.7, -4.3, -DEPTH / 2)), np.array((8.7, 4.3, DEPTH / 2))
# The picture: wavelength in cm, and fringes of the tilted reference from bottom to top.
WAVELENGTH, CARRIER = 532e-7, 24


def turning(beta, mach):
    """Angle by which an oblique shock at the angle beta turns the flow."""
    normal = (mach * np.sin(beta)) ** 2
    return np.arctan(2 / np.tan(beta) * (normal - 1) / (mach**2 * (GAMMA + np.cos(2 * beta)) + 2))


def prandtl_meyer(mach):
    c = np.sqrt((GAMMA + 1) / (GAMMA - 1))
    m = np.sqrt(mach**2 - 1)
    return c * np.arctan(m / c) - np.arctan(m)


def root(f, low, high):
    """Where f, negative at low and positive at high, is zero."""
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if f(middle) < 0 else (low, middle)
    return (low + high) / 2


def shock(mach, angle):
    """Angle of the weak oblique shock that turns the flow by an angle, ratio of densities, Mach number behind."""
    weak = np.linspace(np.arcsin(1 / mach), np.pi / 2, 10_001)
    strongest = weak[np.argmax(turning(weak, mach))]
    beta = root(lambda b: turning(b, mach) - angle, np.arcsin(1 / mach), strongest)
    normal = (mach * np.sin(beta)) ** 2
    ratio = (GAMMA + 1) * normal / ((GAMMA - 1) * normal + 2)
    behind = (1 + (GAMMA - 1) / 2 * normal) / (GAMMA * normal - (GAMMA - 1) / 2)
    return beta, ratio, np.sqrt(behind) / np.sin(beta - angle)


def isentropic(mach):
    """Density over that at rest."""
    return (1 + (GAMMA - 1) / 2 * mach**2) ** (-1 / (GAMMA - 1))


def flow(x, y):
    """The density at points above the axis, where the chord is [0, 1]."""
    beta1, ratio1, mach2 = shock(MACH, HALF_ANGLE)
    rho2 = AHEAD * ratio1
    nu2 = prandtl_meyer(mach2)
    mach3 = root(lambda m: prandtl_meyer(m) - nu2 - 2 * HALF_ANGLE, mach2, 10)
    rho3 = rho2 * isentropic(mach3) / isentropic(mach2)
    beta4, ratio4, _ = shock(mach3, HALF_ANGLE)

    # In the fan each ray from the shoulder has one Mach number: its angle is μ + θ, with θ the flow's direction.
    machs = np.linspace(mach2, mach3, 200)
    directions = HALF_ANGLE - (prandtl_meyer(machs) - nu2)
    rays = np.arcsin(1 / machs) + directions
    from_shoulder = np.arctan2(y - np.tan(HALF_ANGLE) / 2, x - 0.5)
    fan = rho2 * isentropic(np.interp(from_shoulder, rays[::-1], machs[::-1])) / isentropic(mach2)
    # Below the shoulder is the airfoil: there what its surface sees.
    rho = np.where(from_shoulder < -np.pi / 2, rho2, fan)

    rho = np.where(np.arctan2(y, x - 1) < beta4 - HALF_ANGLE, rho3 * ratio4, rho)
    return np.where(np.arctan2(y, x) > beta1, AHEAD, rho)


def smooth(t):
    """0 up to t = 0, 1 from t = 1, smooth in between."""
    t = np.clip(t, 0, 1)
    return t**3 * (t * (6 * t - 15) + 10)


def density():
    """The density at the samples, [z, y, x]. Fronts are as thick as two samples. At the walls of the tunnel, across
    the line of sight, and outside of the picture it becomes that of the flow ahead, so that nothing jumps."""
    fine = 4
    x, y = ((np.linspace(-0.5, n - 0.5, fine * n, endpoint=False) + 0.5 / fine) / (n - 1) for n in SIZE[:2])
    x, y = LOW[0] + x * (HIGH - LOW)[0], LOW[1] + y * (HIGH - LOW)[1]
    plane = flow(x[None, :] / CHORD, np.abs(y[:, None]) / CHORD)
    plane = plane.reshape(SIZE[1], fine, SIZE[0], fine).mean(axis=(1, 3))
    kernel = np.array((1, 4, 6, 4, 1)) / 16
    for axis in (0, 1):
        pad = [(2, 2) if a == axis else (0, 0) for a in (0, 1)]
        plane = np.apply_along_axis(np.convolve, axis, np.pad(plane, pad, "edge"), kernel, "valid")

    x, y, z = (np.linspace(l, h, n) for l, h, n in zip(LOW, HIGH, SIZE))
    edge = [smooth(np.minimum(a - l, h - a) / w) for a, l, h, w in zip((x, y, z), LOW, HIGH, (0.3, 0.3, 1.6))]
    window = edge[2][:, None, None] * edge[1][:, None] * edge[0]
    # Twelve bits of contrast: the file gets smaller, and nothing is seen of it.
    return AHEAD + np.round((plane - AHEAD) * window * 4096) / 4096


def write_vti(path, rho):
    """A .vti file of one array, raw appended, compressed by zlib in one block."""
    spacing = (HIGH - LOW) / (np.array(SIZE) - 1)
    numbers = lambda values: " ".join(f"{v:.9g}" for v in values)
    extent = " ".join(f"0 {n - 1}" for n in SIZE)
    data = rho.astype("<f4").tobytes()
    packed = zlib.compress(data, 9)
    header = struct.pack("<4I", 1, len(data), 0, len(packed))
    path.write_bytes(
        f"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt32" compressor="vtkZLibDataCompressor">
  <ImageData WholeExtent="{extent}" Origin="{numbers(LOW)}" Spacing="{numbers(spacing)}">
    <Piece Extent="{extent}">
      <PointData>
        <DataArray type="Float32" Name="density" format="appended" offset="0"/>
      </PointData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _""".encode()
        + header
        + packed
        + b"\n  </AppendedData>\n</VTKFile>\n"
    )


def write_airfoil(path):
    """The airfoil from wall to wall, as an OBJ mesh."""
    h = np.tan(HALF_ANGLE) * CHORD / 2
    corners = [(0, 0), (CHORD / 2, -h), (CHORD, 0), (CHORD / 2, h)]
    lines = ["# diamond airfoil; by shock.py"]
    lines += [f"v {x:.6g} {y:.6g} {z:.6g}" for z in (-0.498 * DEPTH, 0.498 * DEPTH) for x, y in corners]
    lines += [f"f {i + 1} {(i + 1) % 4 + 1} {(i + 1) % 4 + 5} {i + 5}" for i in range(4)]
    lines += ["f 4 3 2 1", "f 5 6 7 8"]
    path.write_text("\n".join(lines) + "\n")


def fringes(rays):
    """What a Mach–Zehnder interferometer with a tilted reference shows, [row, column]: (1 + cos 2π(OPD/λ + tilt))/2,
    and black where rays end at the airfoil. Takes the quantities that the integrator aov writes."""
    ends, path_difference = rays[..., 3], rays[..., 13]
    tilt = CARRIER * (np.arange(rays.shape[0]) + 0.5)[:, None] / rays.shape[0]
    seen = ends < -0.4999 * DEPTH
    return seen * (1 + np.cos(2 * np.pi * (path_difference / WAVELENGTH + tilt))) / 2


if len(sys.argv) == 1:
    write_vti(HERE / "shock.vti", density())
    write_airfoil(HERE / "shock.obj")
elif sys.argv[1] == "fringes":
    np.save(sys.argv[3], fringes(np.load(sys.argv[2])).astype(np.float32))
