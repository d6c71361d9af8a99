"""Distributed renders equal the render of one process, bit for bit, whatever happens to the
processes."""

import concurrent.futures
import multiprocessing
import os
import pathlib
import signal
import threading
import time

import morgana
import morgana.distributed
import numpy as np
import pytest
from conftest import SCENES, load, meters, small

SPP = 8


def same(found, whole):
    """Asserts that two results are equal in all fields."""
    np.testing.assert_array_equal(found.image, whole.image)
    np.testing.assert_array_equal(found.variance, whole.variance)
    assert found.stats["counters"] == whole.stats["counters"]
    assert found.stats["balance"] == whole.stats["balance"]
    assert found.layers.keys() == whole.layers.keys()
    for name, layer in found.layers.items():
        np.testing.assert_array_equal(layer.mean, whole.layers[name].mean)
        np.testing.assert_array_equal(layer.variance, whole.layers[name].variance)


def shared(scene, executor, **options):
    """Renders distributed, ignoring warnings."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", morgana.SceneWarning)
        return morgana.distributed.render(scene, executor, **options)


def grid(n):
    """The ball with an index from an array of n³ samples."""
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, n)], indexing="ij")
    index = 1.3 + 0.05 * np.exp(-4 * (x**2 + y**2 + z**2))
    volume = {"type": "bspline", "data": index, "placement": "nodes"}
    return small(ior={**volume, "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]})


@pytest.fixture(scope="module")
def processes():
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(3, mp_context=context) as pool:
        yield pool


@pytest.mark.parametrize("integrator", ["path", "bdpt", "vcm", "sppm"])
def test_processes_give_the_same_bits(processes, integrator):
    scene = small(integrator)
    scene["sensor"]["film"]["decomposition"] = "bounce"
    scene["sensor"]["film"]["max_bounces"] = 2
    whole = morgana.render(load(scene), spp=SPP, seed=5)
    for shards in (1, 3, SPP, 100):
        same(shared(scene, processes, spp=SPP, seed=5, shards=shards), whole)


def test_meters_give_the_same_bits(processes):
    whole = morgana.render(load(meters()), particles=1000, seed=2)
    found = shared(meters(), processes, particles=1000, seed=2, shards=5)
    for name, reading in whole.meters.items():
        np.testing.assert_array_equal(found.meters[name].mean, reading.mean)
        np.testing.assert_array_equal(found.meters[name].error, reading.error)
    assert found.stats["counters"] == whole.stats["counters"]


def test_files_and_parameters(processes):
    options = {"width": 24, "height": 18}
    whole = morgana.render(morgana.load_file(SCENES / "grid_lens.xml", **options), spp=2)
    path = pathlib.Path(os.path.relpath(SCENES / "grid_lens.xml"))
    same(morgana.distributed.render(path, processes, parameters=options, spp=2), whole)


def test_large_arrays_go_by_a_file_that_is_removed(processes, tmp_path):
    scene = grid(64)
    seen = []
    found = shared(scene, processes, spp=2, folder=tmp_path, progress=lambda _: seen.extend(tmp_path.iterdir()))
    same(found, morgana.render(load(scene), spp=2))
    assert len(set(seen)) == 1 and seen[0].stat is not None
    assert list(tmp_path.iterdir()) == []


def test_threads_are_processes_enough():
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        same(shared(small(), pool, spp=SPP), morgana.render(load(small()), spp=SPP))


class Failing(concurrent.futures.ThreadPoolExecutor):
    """An executor whose tasks fail a number of times before they succeed."""

    def __init__(self, failures, error):
        super().__init__(2)
        self.left, self.error, self.lock = failures, error, threading.Lock()

    def submit(self, function, *arguments):
        def task():
            with self.lock:
                self.left -= 1
                failing = self.left >= 0
            if failing:
                raise self.error
            return function(*arguments)

        return super().submit(task)


def test_lost_parts_are_tried_again():
    whole = morgana.render(load(small()), spp=SPP)
    with Failing(5, OSError("gone")) as pool:
        same(shared(small(), pool, spp=SPP), whole)
    with Failing(5, OSError("gone")) as pool:
        with pytest.raises(morgana.RenderError, match="part 0 failed: OSError: gone"):
            shared(small(), pool, spp=SPP, shards=1, retries=3)
    # A task that would fail again is not repeated.
    with Failing(1, morgana.RenderError("wrong")) as pool:
        with pytest.raises(morgana.RenderError, match="wrong"):
            shared(small(), pool, spp=SPP)


def test_interruptions_give_what_there_is():
    pressed = []

    def interrupt(share):
        if share > 0 and not pressed:
            pressed.append(share)
            raise KeyboardInterrupt

    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        found = shared(small(), pool, spp=SPP, shards=SPP, progress=interrupt)
    assert found.stopped == "interrupted"
    assert 1 <= found.stats["spp"] < SPP


def test_scenes_travel_as_what_they_were_made_of():
    scene = load(small())
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert shared(scene, pool, spp=4, shards=2) == morgana.render(scene, spp=4)


def test_what_makes_no_sense_is_refused(tmp_path):
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        for options, why in [({"spp": 0}, "spp is 0"), ({"shards": 0}, "shards is 0"), ({"particles": 9}, "particles is for")]:
            with pytest.raises(morgana.RenderError, match=why):
                shared(small(), pool, **options)
        with pytest.raises(morgana.RenderError, match="has fixed parameters"):
            shared(load(small()), pool, parameters={"density": 1})
        with pytest.raises(morgana.SceneError):
            shared({"type": "scene", "ball": {"type": "sphere", "radius": -1}}, pool)


def test_a_scene_that_changes_meanwhile_is_noticed(tmp_path):
    path = tmp_path / "scene.json"
    text = '{{"type": "scene", "sensor": {{"type": "perspective", "film": {{"type": "hdrfilm", "width": 4, "height": 4}}}}, "sky": {{"type": "constant", "radiance": {}}}}}'
    path.write_text(text.format(1.0))

    class Changing(concurrent.futures.ThreadPoolExecutor):
        def submit(self, *task):
            # Replace the file at once: an earlier task may be reading it.
            other = tmp_path / "other.json"
            other.write_text(text.format(2.0))
            other.replace(path)
            return super().submit(*task)

    with Changing(1) as pool:
        with pytest.raises(morgana.RenderError, match="its files differ, or have changed"):
            shared(path, pool, spp=2)


# Dask and its dependencies cause warnings by themselves.
@pytest.mark.filterwarnings("ignore")
class TestDask:
    @pytest.fixture(scope="class")
    def client(self):
        distributed = pytest.importorskip("dask.distributed")
        options = {"dashboard_address": None, "silence_logs": 50}
        with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, **options) as cluster:
            with distributed.Client(cluster) as client:
                yield client

    def test_the_same_bits(self, client):
        whole = morgana.render(load(grid(64)), spp=SPP, seed=1)
        same(shared(grid(64), client, spp=SPP, seed=1), whole)

    def test_workers_that_are_lost(self, client):
        scene = small()
        whole = morgana.render(load(scene), spp=2000, seed=3)
        killed = []

        def kill(share):
            # Kill two workers of three, each in the middle of a task.
            if len(killed) < 2 and share > 0.2 * (1 + len(killed)):
                pids = client.run(os.getpid)
                pid = next(p for p in pids.values() if p not in killed)
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
                time.sleep(0.2)

        same(shared(scene, client, spp=2000, seed=3, shards=40, progress=kill), whole)
        assert len(killed) == 2
