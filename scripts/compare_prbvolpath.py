"""Derivatives by voxels of smoke, compared with Mitsuba 3's prbvolpath for straight rays: agreement and CPU time.

    PYTHON_WITH_BOTH scripts/compare_prbvolpath.py --voxels 8 --spp 256

Mitsuba's data are grids over an equal cube, clamped; both programs interpolate linearly. The loss
is Σ weight × pixel.
"""

import argparse
import time

import numpy as np

BATCHES = 16


def density(voxels):
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, voxels)], indexing="ij")
    return (0.4 + 1.2 * np.exp(-4 * ((x - 0.2) ** 2 + y**2 + z**2))).astype(np.float32)


def scene(voxels, pixels, albedo, depth):
    """Returns the parts of the scene that both descriptions share; each adds its own `grid`."""
    film = {"type": "hdrfilm", "width": pixels, "height": pixels, "pixel_format": "luminance", "rfilter": {"type": "box"}}
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 35, "film": film},
        "sky": {"type": "constant", "radiance": 1.0},
        "cube": {"type": "cube", "bsdf": {"type": "null"}, "interior": {"type": "heterogeneous", "albedo": albedo}},
    }


ORIGIN, TARGET, UP = [0.5, 1, -6], [0, 0, 0], [0, 1, 0]


def by_morgana(given, weights):
    import morgana

    made = scene(given.voxels, given.pixels, given.albedo, given.depth)
    made["integrator"] = {"type": "path", "max_depth": given.depth}
    made["sensor"]["to_world"] = [{"lookat": {"origin": ORIGIN, "target": TARGET, "up": UP}}]
    grid = {"type": "gridvolume", "data": density(given.voxels), "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]}
    made["cube"]["interior"].update(id="smoke", sigma_t=grid)
    loaded = morgana.load_dict(made)
    started = time.process_time()
    image = morgana.render(loaded, spp=given.spp, threads=1).image
    rendered = time.process_time() - started
    started = time.process_time()
    found = morgana.derivatives(loaded, ["smoke.sigma_t"], weights, spp=given.spp, threads=1)["smoke.sigma_t"]
    spent = time.process_time() - started
    return image[..., 0], found.value[..., 0], found.error[..., 0], rendered, spent


def by_mitsuba(given, weights):
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_mono")
    dr.set_thread_count(1)
    made = scene(given.voxels, given.pixels, given.albedo, given.depth)
    made["integrator"] = {"type": "prbvolpath", "max_depth": given.depth}
    made["sensor"]["to_world"] = mi.ScalarTransform4f().look_at(origin=ORIGIN, target=TARGET, up=UP)
    cube = mi.ScalarTransform4f().translate([-1, -1, -1]).scale(2)
    grid = mi.VolumeGrid(density(given.voxels)[..., None])
    made["cube"]["interior"]["sigma_t"] = {"type": "gridvolume", "grid": grid, "to_world": cube}
    loaded = mi.load_dict(made)
    parameters = mi.traverse(loaded)
    key = next(name for name in parameters.keys() if name.endswith("sigma_t.data"))
    each = max(given.spp // BATCHES, 1)
    gradients, images, spent = [], [], 0.0
    for batch in range(BATCHES + 1):
        data = parameters[key]
        dr.enable_grad(data)
        parameters.update()
        started = time.process_time()
        image = mi.render(loaded, parameters, spp=each, seed=2 * batch, seed_grad=2 * batch + 1)
        dr.backward(dr.sum(dr.ravel(image) * mi.Float(weights.ravel().astype(np.float32))))
        gradient = np.array(dr.grad(data)).reshape(density(given.voxels).shape)
        # Skip the first batch, which includes compilation.
        if batch:
            spent += time.process_time() - started
            gradients.append(gradient)
            images.append(np.array(image)[..., 0])
        parameters[key] = dr.detach(data)
    gradients = np.array(gradients)
    return np.mean(images, axis=0), gradients.mean(axis=0), gradients.std(axis=0, ddof=1) / np.sqrt(BATCHES), spent


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voxels", type=int, default=8, help="along each axis")
    parser.add_argument("--pixels", type=int, default=32, help="along each side")
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--albedo", type=float, default=0.8)
    parser.add_argument("--depth", type=int, default=16)
    given = parser.parse_args()

    weights = np.random.default_rng(0).random((given.pixels, given.pixels, 1)) / given.pixels**2
    image, value, error, rendered, spent = by_morgana(given, weights)
    print(f"morgana: mean {image.mean():.5f}, render {rendered:.2f} s, derivatives {spent:.2f} s ({spent / rendered:.2f} ×)")
    others_image, others, others_error, others_spent = by_mitsuba(given, weights)
    print(f"mitsuba: mean {others_image.mean():.5f}, render and derivatives {others_spent:.2f} s")
    z = (value - others) / np.hypot(error, others_error)
    print(f"sum: {value.sum():.5f} and {others.sum():.5f}; z of voxels: mean square {np.mean(z**2):.2f}, largest {np.abs(z).max():.2f}")
    print(f"errors: {np.sqrt(np.mean(error**2)):.3g} and {np.sqrt(np.mean(others_error**2)):.3g}")


if __name__ == "__main__":
    main()
