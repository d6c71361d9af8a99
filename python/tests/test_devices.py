"""Measurements on a GPU. Tests of the walk itself are in crates/gpu/tests."""

import json
import os
import subprocess

import morgana
import numpy as np
import pytest
from conftest import PROGRAM


def tissue():
    place = [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2}]
    medium = {"type": "homogeneous", "sigma_a": 0.2, "sigma_s": 4, "ior": 1.4, "phase": {"type": "hg", "g": 0.8}}
    return {
        "type": "scene",
        "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 0.5, "power": 2, "to_world": [{"translate": [0, 0, -3]}]},
        "tissue": {"type": "cube", "bsdf": {"type": "dielectric"}, "interior": medium},
        "cells": {"type": "fluencemeter", "nx": 6, "ny": 6, "nz": 6, "to_world": place},
    }


@pytest.fixture(scope="module")
def gpu():
    """The first GPU, which may be Mesa's software Vulkan."""
    found = morgana.devices()
    if not found:
        if "MORGANA_ALL_TESTS" in os.environ:
            pytest.fail("no GPU was found, or the package is built without the feature gpu")
        pytest.skip("no GPU, or no support for GPUs")
    return found[0]


def refused(folder, *arguments):
    """Returns what the program prints when it fails."""
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
    assert done.returncode != 0
    return done.stderr


def test_fluence_on_a_gpu(gpu):
    on_gpu = morgana.render(tissue(), particles=20_000, seed=1, device="gpu")
    on_cpu = morgana.render(tissue(), particles=20_000, seed=2)
    assert on_gpu.stats["device"] == gpu.name and on_cpu.stats["device"] == "cpu"
    a, b = on_gpu.meters["fluence"], on_cpu.meters["fluence"]
    z = (a.mean - b.mean) / np.hypot(a.error, b.error)
    # False alarms: 2e-4 for all 216 bins.
    assert abs(z).max() < 5
    assert 0.8 < z.std() < 1.2
    again = morgana.render(tissue(), particles=20_000, seed=1, device="gpu:0", threads=1)
    np.testing.assert_array_equal(again.meters["fluence"].mean, a.mean)


def test_program_and_package_agree(gpu, program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(tissue()))
    said = program("render", "scene.json", "--particles", 20000, "--seed", 1, "--device", "gpu", "-o", "out.npz")
    assert f"particles/s on {gpu.name}" in said
    result = morgana.render(tissue(), particles=20_000, seed=1, device="gpu")
    np.testing.assert_array_equal(np.load(tmp_path / "out.npz")["fluence"], result.meters["fluence"].mean)


def test_shards_and_checkpoints_on_a_gpu(gpu, program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(tissue()))
    options = ["scene.json", "--particles", 20000, "--seed", 1]
    program("render", *options, "--device", "gpu", "-o", "whole.npz")
    for index in range(3):
        program("render", *options, "--device", "gpu", "--shard", f"{index}/3")
    program("merge", *(f"scene.{index}-of-3.part" for index in range(3)), "-o", "merged.npz")
    whole, merged = np.load(tmp_path / "whole.npz"), np.load(tmp_path / "merged.npz")
    np.testing.assert_array_equal(whole["fluence"], merged["fluence"])
    np.testing.assert_array_equal(whole["fluence_error"], merged["fluence_error"])
    # A checkpoint continues with batches of the same size, though the total differs.
    program("render", *options, "--device", "gpu", "--checkpoint", "run.part", "-o", "first.npz")
    longer = ["scene.json", "--particles", 80000, "--seed", 1, "--checkpoint", "run.part", "--resume"]
    program("render", *longer, "--device", "gpu", "-o", "longer.npz")
    assert np.load(tmp_path / "longer.npz")["fluence_error"].mean() < 0.6 * whole["fluence_error"].mean()
    assert "it was rendered with device = gpu, not (none)" in refused(tmp_path, "render", *longer, "-o", "cpu.npz")


def test_scenes_say_whether_a_gpu_can_run_them(program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(tissue()))
    assert "can run this scene: --device gpu" in program("info", "scene.json")
    other = tissue()
    other["cells"]["nx"] = 4
    other["ball"] = {"type": "sphere", "center": [0, 0, 5]}
    (tmp_path / "other.json").write_text(json.dumps(other))
    reason = "a GPU cannot run this scene: it needs one label volume, or one cube, and no other shape"
    assert reason in program("info", "other.json")
    assert reason in refused(tmp_path, "render", "other.json", "--device", "gpu")
    with pytest.raises(morgana.RenderError, match=reason):
        morgana.render(other, particles=100, device="gpu")


def test_auto_says_what_it_chose(program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(tissue()))
    said = program("render", "scene.json", "--particles", 1000, "--device", "auto", "-o", "out.npz")
    assert "on the CPU: a GPU pays off from 100000 particles on" in said


@pytest.mark.parametrize("wrong", ["cuda", "gpu:x", "", "gpu:99"])
def test_wrong_devices_are_refused(wrong):
    with pytest.raises(morgana.RenderError, match="device is|no GPU|cannot use GPUs"):
        morgana.render(tissue(), particles=100, device=wrong)
    with pytest.raises(TypeError, match="device is 1 but must be a text"):
        morgana.render(tissue(), particles=100, device=1)


def test_pictures_stay_on_the_cpu():
    scene = {"type": "scene", "sensor": {"type": "perspective"}, "sky": {"type": "constant"}}
    with pytest.raises(morgana.RenderError, match="this scene has a camera"):
        morgana.render(scene, spp=1, device="gpu")
