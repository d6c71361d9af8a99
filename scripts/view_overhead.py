#!/usr/bin/env python3
"""Measures the cost of watching a render (docs/guides/viewer.md#what-watching-costs).

A client requests the data that a visible page requests. These are the progress of the render twice
a second, and for each new image the colours, their variances and the numbers of samples under the
cursor. Two measurements:

* instructions (--instructions), by callgrind: the instructions that make images, as a fraction of the render's,
  and the server's for each request. Callgrind is about fifty times slower than the processor, so that a page
  makes far more requests per instruction than without it. The limit on images bounds their fraction from above;
  the server's fraction is computed for the number of requests of a page in a second of a render without callgrind;
* processor time: pairs of renders of equal samples, watched and not, one right after the other, each first in turn.
  The median of the ratios of their processor times with its confidence interval (by order statistics, at least 95 %),
  and the processor time of the server's threads for each request. Renders must be long, and the machine otherwise
  idle, because a page makes its requests by the clock.

Usage: scripts/view_overhead.py [--program target/release/morgana] [--instructions | --pairs 20] [--spp N] [--size W H]
"""

import argparse
import json
import math
import os
import pathlib
import re
import signal
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENE = ROOT / "scenes/luneburg_fog.xml"
POLL = 0.5
"""Seconds between two status requests of a page."""
INTERVAL = 1.0
"""Smallest interval between two images, in seconds."""
PLANES = [
    *(("", c) for c in "RGB"),
    *(("variance", c) for c in "RGB"),
    ("samples", "N"),
]

MAX_REQUESTS = 1 / POLL + len(PLANES) / INTERVAL
"""Largest number of requests of a page per second."""


def get(address, path):
    with urllib.request.urlopen(f"{address}api/{path}", timeout=600) as response:
        return response.read()


def watch(address, taken):
    """Makes the requests of a page until the render has ended; counts images and bytes."""
    version = 0
    while True:
        status = json.loads(get(address, "0/status"))
        taken["requests"] += 1
        if status["version"] != version:
            version = status["version"]
            taken["pictures"] += 1
            for layer, channel in PLANES:
                path = f"0/plane?layer={layer}&channel={channel}&version={version}"
                taken["bytes"] += len(get(address, path))
                taken["requests"] += 1
        if status["ended"]:
            return
        time.sleep(POLL)


def command(arguments, folder, is_watched, threads):
    size = ["-D", f"width={arguments.size[0]}", "-D", f"height={arguments.size[1]}"]
    chosen = [
        "--spp",
        str(arguments.spp),
        "--integrator",
        "path",
        "--threads",
        str(threads),
        "-q",
    ]
    view = ["--view"] if is_watched else []
    return [
        str(arguments.program),
        "render",
        str(SCENE),
        *size,
        *chosen,
        *view,
        "-o",
        f"{folder}/a.npy",
    ]


def processor_time(pid):
    """Returns the seconds of all threads of a process, including ended ones."""
    return time.clock_gettime((~pid << 3) | 2)


def of_threads(pid):
    """Returns the seconds of the live threads of a process, except the server's."""
    total = 0
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        if not (task / "comm").read_text().startswith("view"):
            total += int((task / "schedstat").read_text().split()[0])
    return total / 1e9


def render(arguments, is_watched, threads=2):
    """Returns the processor times of a render and of its server, and the client's counts."""
    taken = {"pictures": 0, "requests": 0, "bytes": 0}
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(command(arguments, folder, is_watched, threads), stdout=subprocess.PIPE, text=True)
        server = 0.0
        if is_watched:
            address = process.stdout.readline().strip()
            watch(address, taken)
            server = processor_time(process.pid) - of_threads(process.pid)
            process.send_signal(signal.SIGINT)
        _, _, usage = wait(process)
        return usage.ru_utime + usage.ru_stime, server, taken


def wait(process):
    done = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(done[1])
    process.stdout.close()
    return done


def interval(values):
    """Returns a confidence interval of the median of at least 95 %, by order statistics."""
    values = sorted(values)
    n = len(values)
    tail, k = 0.0, 0
    while tail + math.comb(n, k) / 2**n <= 0.025:
        tail += math.comb(n, k) / 2**n
        k += 1
    return (values[k - 1], values[n - k]) if k else (-math.inf, math.inf)


def pairs(arguments):
    ratios, server, requests = [], 0.0, 0
    for i in range(arguments.pairs):
        order = [False, True] if i % 2 == 0 else [True, False]
        done = {is_watched: render(arguments, is_watched) for is_watched in order}
        (plain, _, _), (watched, served, taken) = done[False], done[True]
        ratios.append(watched / plain)
        server += served
        requests += taken["requests"]
        print(f"{i}: {plain:.2f} s, watched {watched:.2f} s, {taken['pictures']} pictures", flush=True)
    low, high = interval(ratios)
    print(f"ratio of processor times: median {statistics.median(ratios):.4f}, 95 % interval {low:.4f} to {high:.4f}")
    print(f"server: {1000 * server / requests:.3f} ms of processor time for each of {requests} requests")
    print(f"at {MAX_REQUESTS:.0f} requests a second, the most of a page, {100 * MAX_REQUESTS * server / requests:.2f} % of one processor")


def instructions(arguments):
    taken = {"pictures": 0, "requests": 0, "bytes": 0}
    with tempfile.TemporaryDirectory() as folder:
        grind = [
            "valgrind",
            "--tool=callgrind",
            "--separate-threads=yes",
            f"--callgrind-out-file={folder}/out",
        ]
        process = subprocess.Popen(
            [*grind, *command(arguments, folder, True, 1)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        address = process.stdout.readline().strip()
        client = threading.Thread(target=watch, args=(address, taken))
        client.start()
        client.join()
        process.send_signal(signal.SIGINT)
        process.wait()
        process.stdout.close()
        total, server, making = 0, 0, 0
        for file in pathlib.Path(folder).glob("out-*"):
            text = file.read_text()
            all_of_thread = int(re.search(r"^(?:summary|totals): (\d+)", text, re.M)[1])
            made = inclusive(text, "view::live::Live::update")
            is_server = "view::server::" in text and "transport::integrator" not in text
            total += all_of_thread
            server += all_of_thread if is_server else 0
            making += made
            print(f"{file.name}: {all_of_thread:,}, {'server' if is_server else 'render'}, pictures {made:,}")
    work = total - making - server
    print(f"{taken['pictures']} pictures, {taken['requests']} requests; {work:,} instructions of the render")
    print(f"making pictures: {100 * making / work:.3f} % of them; each request: {server // taken['requests']:,} instructions")
    seconds, _, _ = render(arguments, False, 1)
    share = MAX_REQUESTS * server / taken["requests"] / (work / seconds)
    print(
        f"the same render without callgrind: {seconds:.2f} s; at {MAX_REQUESTS:.0f} requests a second, the most of a page, serving is {100 * share:.3f} %"
    )


def inclusive(text, name):
    """Returns the instructions of calls of a function from others, including everything that it
    calls."""
    names = dict(re.findall(r"\((\d+)\) (.*)", text))
    total, is_called = 0, False
    for line in text.splitlines():
        if line.startswith("cfn="):
            is_called = name in names.get(re.match(r"cfn=\((\d+)\)", line)[1], "")
        elif line.startswith("fn="):
            is_called = False
        elif line.startswith("calls=") and is_called:
            is_called = None
        elif is_called is None:
            total += int(line.split()[1])
            is_called = False
    return total


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/morgana")
    parser.add_argument("--instructions", action="store_true", help="count instructions by callgrind")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", type=int, nargs=2, default=[240, 160])
    arguments = parser.parse_args()
    if arguments.instructions:
        instructions(arguments)
    else:
        pairs(arguments)


if __name__ == "__main__":
    main()
