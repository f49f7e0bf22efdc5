#!/usr/bin/python3
"""What many recordings cost: `camgyro batch` over COUNT devices with one recording each, with 1, 2
and 4 workers, and the workflow of tools/fleet where snakemake is installed. Prints a table:

    tools/fleet/cost.py [--camgyro PATH] [--count N] [--workers 1,2,4] [RECORDING]

RECORDING is used COUNT times; without, 30 s of rendered video of 640 x 480 are made.
"""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FLEET, LENGTH_S = 10000, 30.0  # phones a day, and the recording of each


def render(camgyro, folder):
    subprocess.run([camgyro, "simulate", SOURCE + "/tools/scenarios/video_room.yaml", "seed=1",
                    "duration_s=%g" % LENGTH_S, "--out", folder], check=True, stdout=sys.stderr)


def length_s(recording):
    with open(recording + "/cam0/data.csv", encoding="utf-8") as file:
        stamps = [int(row.split(",")[0]) for row in file if row[0].isdigit()]
    return 1e-9 * (stamps[-1] - stamps[0])


def run(command):
    """Wall time, processor time [s] and the largest process's memory [MB], of it and all that it
    started."""
    begin = time.monotonic()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    words = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        raise SystemExit("%s: %s" % (" ".join(command), words.decode()))
    return time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", nargs="?")
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--workers", default="1,2,4")
    options = parser.parse_args()
    camgyro = os.path.abspath(options.camgyro)
    with tempfile.TemporaryDirectory() as folder:
        recording = options.recording
        if recording is None:
            recording = folder + "/video"
            render(camgyro, recording)
        with open(folder + "/list.csv", "w", encoding="utf-8") as manifest:
            manifest.write("device,recording\n")
            for number in range(options.count):
                shutil.copytree(recording, "%s/r%d" % (folder, number))
                manifest.write("device%d,r%d\n" % (number, number))
        hours = options.count * length_s(recording) / 3600
        print("%d recordings of %.0f s, %d cores, load before %.1f" % (
            options.count, length_s(recording), os.cpu_count(), os.getloadavg()[0]))
        print("\n| Run by | workers | wall time | processor time | memory of a worker | core-hours "
              "per recording-hour | cores for %d recordings of %.0f s a day |" % (FLEET, LENGTH_S))
        print("| --- | --- | --- | --- | --- | --- | --- |")
        rows = [("`camgyro batch`", workers,
                 [camgyro, "batch", folder + "/list.csv", "--jobs=%d" % workers, "--threads=1",
                  "--out=%s/batch%d" % (folder, workers)])
                for workers in map(int, options.workers.split(","))]
        if shutil.which("snakemake"):
            rows.append(("Snakemake", os.cpu_count(),
                         ["snakemake", "-s", SOURCE + "/tools/fleet/Snakefile", "-d", folder,
                          "--cores", str(os.cpu_count()), "--config", "camgyro=" + camgyro,
                          "manifest=%s/list.csv" % folder, "out=%s/fleet" % folder]))
        for name, workers, command in rows:
            wall_s, processor_s, memory_mb = run(command)
            cost = processor_s / 3600 / hours
            print("| %s | %d | %.0f s | %.0f s | %.0f MB | %.2f | %.1f |" % (
                name, workers, wall_s, processor_s, memory_mb, cost,
                cost * FLEET * LENGTH_S / 86400), flush=True)


if __name__ == "__main__":
    main()
