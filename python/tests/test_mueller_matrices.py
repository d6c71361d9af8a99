"""Mueller matrices of slabs of spheres, against an independent solution and against symmetry (docs/meters.md#polarised-light).

The reference is a solution of the transport equation by adding–doubling, with amplitudes by Mie's series in the form of Bohren and Huffman (1983). It shares
nothing with morgana. Its matrices change by less than 1e-6 if the nodes and azimuths grow by half, or if doubling starts from a layer eight times as thick.

Runs with horizontal and with right-handed light give all 16 elements, because turns about the beam change nothing. Equal seeds give equal paths, so
that differences of the runs have little noise. False-alarm rate of the file: below 1e-3 (72 comparisons; |z| of a normal number exceeds 4.5 once in 147 000).
"""

import morgana
import numpy as np
import pytest

special = pytest.importorskip("scipy.special")

RADIUS, SPHERES, WATER, WAVELENGTH = 0.2, 1.59, 1.33, 0.6328
"""Spheres of polystyrene in water, in µm."""
DEPTH = 3.0
"""Thickness of the slab in mean free paths, the unit of the scene."""
LIMIT = 4.5


def amplitudes(x, m, cosines):
    """Mie's amplitudes S1 and S2 (Bohren and Huffman 1983) and the efficiency of scattering."""
    orders = np.arange(1, int(x + 4 * x ** (1 / 3) + 12))

    def regular(z):
        """Riccati–Bessel functions ψ and their derivatives."""
        j = special.spherical_jn(orders, z)
        return z * j, j + z * special.spherical_jn(orders, z, True)

    (inside, inside_slope), (outside, outside_slope) = regular(m * x), regular(x)
    y = special.spherical_yn(orders, x)
    wave, wave_slope = outside + 1j * x * y, outside_slope + 1j * (y + x * special.spherical_yn(orders, x, True))
    a = (m * inside * outside_slope - outside * inside_slope) / (m * inside * wave_slope - wave * inside_slope)
    b = (inside * outside_slope - m * outside * inside_slope) / (inside * wave_slope - m * wave * inside_slope)
    s1, s2 = np.zeros(cosines.shape, complex), np.zeros(cosines.shape, complex)
    before, pi = np.zeros(cosines.shape), np.ones(cosines.shape)
    for n, an, bn in zip(orders, a, b):
        tau = n * cosines * pi - (n + 1) * before
        s1 += (2 * n + 1) / (n * (n + 1)) * (an * pi + bn * tau)
        s2 += (2 * n + 1) / (n * (n + 1)) * (an * tau + bn * pi)
        before, pi = pi, ((2 * n + 1) * cosines * pi - (n + 1) * before) / n
    return s1, s2, 2 / x**2 * np.sum((2 * orders + 1) * (abs(a) ** 2 + abs(b) ** 2))


def rotated(cosine, sine):
    """Stokes vectors in frames that are turned anticlockwise, for an observer who looks at the light."""
    c, s = cosine**2 - sine**2, 2 * cosine * sine
    out = np.zeros((*np.shape(cosine), 4, 4))
    out[..., 0, 0] = out[..., 3, 3] = 1
    out[..., 1, 1] = out[..., 2, 2] = c
    out[..., 1, 2], out[..., 2, 1] = s, -s
    return out


def scattering(x, m, cosines):
    """Mie's matrix, with a mean of 1 over all directions. The first axis of the frames is in the plane of scattering."""
    s1, s2, efficiency = amplitudes(x, m, cosines)
    f = np.zeros((*cosines.shape, 4, 4))
    f[..., 0, 0] = f[..., 1, 1] = (abs(s1) ** 2 + abs(s2) ** 2) / 2
    f[..., 0, 1] = f[..., 1, 0] = (abs(s2) ** 2 - abs(s1) ** 2) / 2
    mixed = s2 * s1.conj()
    f[..., 2, 2] = f[..., 3, 3] = mixed.real
    f[..., 2, 3], f[..., 3, 2] = -mixed.imag, mixed.imag
    return f * 4 / (efficiency * x**2)


def slab(x, m, depth, nodes=20, azimuths=64, doublings=24):
    """Mueller matrices, in meridian planes, of the scattered power that a slab reflects and transmits from a beam along its normal."""
    # Radau's quadrature has a node at the normal. It stands aside by 4e-5, because meridian planes are undefined there.
    interior, weights = special.roots_jacobi(nodes - 1, 1, 0)
    mu = np.append((interior + 1) / 2, 1.0)
    weights = np.append(weights / (1 - interior), 2 / nodes**2) / 2
    cosine = np.concatenate([-mu, mu])
    cosine[[nodes - 1, -1]] *= 1 - 1e-9
    sine = np.sqrt(1 - cosine**2)
    phi = (np.arange(azimuths) + 0.5) * 2 * np.pi / azimuths

    def directions(cosine, sine, phi):
        """Directions, and first axes of their frames in meridian planes."""
        direction = sine * np.cos(phi), sine * np.sin(phi), cosine
        axis = cosine * np.cos(phi), cosine * np.sin(phi), -sine
        return (np.stack(np.broadcast_arrays(*of), axis=-1) for of in (direction, axis))

    def turn(direction, before, after):
        return rotated(np.sum(before * after, axis=-1), np.sum(np.cross(direction, before) * after, axis=-1))

    # Scattering matrices between meridian planes: out, into, azimuth.
    out, out_axis = directions(cosine[:, None, None], sine[:, None, None], phi)
    into, into_axis = directions(cosine[None, :, None], sine[None, :, None], np.zeros(1))
    normal = np.cross(into, out)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    first, last = turn(into, into_axis, np.cross(normal, into)), turn(out, np.cross(normal, out), out_axis)
    matrices = last @ scattering(x, m, np.clip(np.sum(into * out, axis=-1), -1, 1)) @ first

    total = {"reflected": 0, "transmitted": 0}
    for order in (-2, 0, 2):                                           # a beam along the normal has no other harmonics
        harmonic = np.mean(matrices * np.exp(-1j * order * phi)[:, None, None], axis=2)
        thin = depth / 2**doublings
        once = harmonic * (thin / 2 * np.append(weights, weights))[:, None, None] / np.abs(cosine)[:, None, None, None]
        once = once.transpose(0, 2, 1, 3).reshape(2, 4 * nodes, 2, 4 * nodes)
        fade, one = np.diag(np.repeat(1 - thin / mu, 4)), np.eye(4 * nodes)
        # Reflection and transmission of light from above and from below.
        r_above, t_above, r_below, t_below = once[1, :, 0], fade + once[0, :, 0], once[0, :, 1], fade + once[1, :, 1]
        for _ in range(doublings):
            down, up = np.linalg.solve(one - r_below @ r_above, t_above), np.linalg.solve(one - r_above @ r_below, t_below)
            r_above, r_below = r_above + t_below @ r_above @ down, r_below + t_above @ r_below @ up
            t_above, t_below = t_above @ down, t_below @ up
        t_above[-4:, -4:] -= np.exp(-depth) * np.eye(4)                # unscattered light
        flux = (weights * mu / weights[-1])[:, None, None]
        for name, of in (("reflected", r_above), ("transmitted", t_above)):
            total[name] = total[name] + np.sum(of.reshape(nodes, 4, nodes, 4)[:, :, -1] * flux, axis=0)
    return {name: of.real for name, of in total.items()}


def records(filter):
    """Light that leaves a slab without boundaries. Its beam along −z passes a filter."""
    spheres = {"type": "mie", "radius": RADIUS, "eta": SPHERES, "ext_eta": WATER, "wavelength": 1000 * WAVELENGTH}
    scene = morgana.load_dict({
        "type": "scene",
        "integrator": {"type": "particle"},
        "slab": {
            "type": "cube", "to_world": [{"scale": [1e4, 1e4, DEPTH / 2]}, {"translate": [0, 0, -DEPTH / 2]}], "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_s": 1.0, "sigma_a": 0.0, "phase": spheres},
            "faces": {"type": "irradiancemeter", "id": "faces", "records": True, "stokes": True},
        },
        "filter": {"type": "rectangle", "to_world": [{"translate": [0, 0, 2]}], "bsdf": filter},
        "beam": {"type": "collimated", "radius": 0.01, "power": 2.0, "to_world": [{"lookat": {"origin": [0, 0, 3], "target": [0, 0, 0], "up": [0, 1, 0]}}]},
    })
    found = morgana.render(scene, particles=50_000, seed=1).records["faces"]
    entering = found.stokes[found.side == 1][:, :, 0].sum(axis=0)
    return found[(found.side == 0) & (found.scatterings.sum(axis=1) > 0)], entering


@pytest.fixture(scope="module")
def runs():
    (horizontal, first), (right, second) = records({"type": "polarizer"}), records({"type": "circular"})
    assert np.allclose(first, [1, 1, 0, 0], atol=1e-6) and np.allclose(second, [1, 0, 0, 1], atol=1e-6)
    assert np.array_equal(horizontal.position, right.position)
    return horizontal, right


def in_frames(found, axis):
    """Stokes parameters of records in frames with these first axes."""
    across = np.cross(found.direction, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turn = rotated(np.sum(across * axis, axis=1), np.sum(np.cross(found.direction, across) * axis, axis=1))
    return (turn @ found.stokes[:, :, :1])[:, :, 0]


def sums(values, particles):
    """Sums of values of particles, and their standard errors. A particle leaves once."""
    total = values.sum(axis=0)
    return total, np.sqrt((values**2).sum(axis=0) - total**2 / particles)


def columns(horizontal, right, azimuth):
    """Contributions of records to a Mueller matrix in planes through the beam, at azimuths."""
    cosine, sine = (of(2 * azimuth)[:, None] for of in (np.cos, np.sin))
    # In the plane at an azimuth, the frame of the beam turns horizontal light to (1, cos 2φ, sin 2φ, 0).
    return np.stack([horizontal, 2 * cosine * horizontal, 2 * sine * horizontal, right - horizontal], axis=2)


@pytest.fixture(scope="module")
def reference():
    return slab(2 * np.pi * WATER * RADIUS / WAVELENGTH, SPHERES / WATER, DEPTH)


def test_the_reference_keeps_energy(reference):
    """Doubling starts from a layer of 3/2²⁴ mean free paths, with errors of the second order in this thickness."""
    assert abs(sum(of[0, 0] for of in reference.values()) + np.exp(-DEPTH) - 1) < 1e-6


@pytest.mark.parametrize("face, name", [(0.0, "reflected"), (-DEPTH, "transmitted")])
def test_slabs_agree_with_adding_doubling(runs, reference, face, name):
    expected = reference[name]
    leaving = [of[np.abs(of.position[:, 2] - face) < 1e-6] for of in runs]
    d = leaving[0].direction
    azimuth = np.arctan2(d[:, 1], d[:, 0])
    axis = np.stack([d[:, 2] * np.cos(azimuth), d[:, 2] * np.sin(azimuth), -np.hypot(d[:, 0], d[:, 1])], axis=1)
    found, error = sums(columns(*(in_frames(of, axis) for of in leaving), azimuth), runs[0].particles)
    z = (found - expected) / error
    assert np.abs(z).max() < LIMIT, z


def test_maps_are_symmetric(runs):
    """Turns about the beam and the mirror plane through it: of the azimuth of the place where light leaves, only some harmonics remain."""
    leaving = [of[np.abs(of.position[:, 2]) < 1e-6] for of in runs]
    d, place = leaving[0].direction, leaving[0].position
    azimuth, radius = np.arctan2(place[:, 1], place[:, 0]), np.hypot(place[:, 0], place[:, 1])
    # The radial direction, carried from the normal to the direction of the light without turning.
    radial = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(len(d))], axis=1)
    axis = radial - (np.sum(radial * d, axis=1) / (1 + d[:, 2]))[:, None] * (d + [0, 0, 1])
    horizontal, right = (in_frames(of, axis) for of in leaving)
    matrix = columns(horizontal, right, azimuth)
    cosine, sine = (of(2 * azimuth)[:, None] for of in (np.cos, np.sin))
    # No mixing of the parameters that the mirror keeps and of those that it reverses.
    zeros = [matrix[:, :2, 2:].reshape(-1, 4), matrix[:, 2:, :2].reshape(-1, 4)]
    # Circular light has no harmonic, horizontal light only the second, with one phase.
    zeros += [right * cosine, right * sine, horizontal[:, 2:] * cosine, horizontal[:, :2] * sine]
    values = np.concatenate(zeros, axis=1)
    for inner, outer in ((0.0, 0.5), (0.5, 2.0)):
        total, error = sums(values[(radius >= inner) & (radius < outer)], runs[0].particles)
        z = total / error
        assert np.abs(z).max() < LIMIT, z
    # The patterns with these symmetries exist.
    total, error = sums(matrix, runs[0].particles)
    assert np.all(np.abs(total / error)[[0, 1, 1, 2, 3], [1, 0, 1, 2, 3]] > 5)
