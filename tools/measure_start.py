#!/usr/bin/python3
"""How good a start is: simulates recordings, runs `camgyro delay` on them, and prints for each kind
of motion, and for a walk round a room, what the delay, the focal length and the readout time of the
start differ by from the truth, and what it says of the lens: how much of the camera's fast turns
it makes up for, and how many recordings are called stabilised or not.

    tools/measure_start.py [--camgyro PATH] [--seeds N] [--duration_s S] [--jobs N] [KEY=VALUE...]

KEY=VALUE: of every scenario, as of `camgyro simulate`. Without a lens that is declared, from tracks
with 0.5 px of noise. Recordings that are refused are counted.
"""
import argparse
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from os.path import abspath, dirname

import numpy as np
import yaml

SOURCE = dirname(dirname(abspath(__file__)))
SCENARIOS = ("motion_walking", "motion_running", "motion_handheld", "motion_slow", "motion_panning",
             "motion_rotation", "scene_room")
NUMBER = r"(-?[0-9.]+)"


def found(text):
    """Delay, focal length and readout time with their sigmas; nothing for what was not found."""
    delay = re.search("^delay +" + NUMBER + " ± " + NUMBER + " ms", text, re.M)
    focal = re.search("focal length " + NUMBER + " ± " + NUMBER + " px", text)
    readout = re.search("readout " + NUMBER + " ± " + NUMBER + " ms", text)
    return [tuple(float(x) for x in match.groups()) if match else None
            for match in (delay, focal, readout)]


def lens_of(text):
    """How much of fast turns the lens makes up for [%], and what the start calls it."""
    match = re.search("^lens +makes up for " + NUMBER + " ± [0-9.]+ % of fast turns: (.*)$", text,
                      re.M)
    return (float(match.group(1)), match.group(2)) if match else None


def measure(camgyro, scenario, seed, duration_s, changes):
    """Of the delay [ms], the focal length [%] and the readout time [ms]: error and sigma, or
    nothing; last what lens_of says; None if the recording is refused."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([camgyro, "simulate", SOURCE + "/tools/scenarios/%s.yaml" % scenario,
                        "seed=%d" % seed, "duration_s=%g" % duration_s, "tracks.noise_px=0.5",
                        *changes, "--out", folder + "/r"], check=True, stdout=subprocess.DEVNULL)
        with open(folder + "/r/truth.yaml", encoding="utf-8") as file:
            truth = yaml.safe_load(file)
        run = subprocess.run([camgyro, "delay", folder + "/r"], capture_output=True, text=True,
                             check=False)
    if run.returncode != 0:
        return None
    readout_ms = 1e3 * truth["shutter"]["readout_s"]["value"]
    focal_px = truth["camera"]["focal_px"]["value"]
    right = (1e3 * truth["clock"]["delay_s"]["value"] + 0.5 * readout_ms, focal_px, readout_ms)
    scale = (1.0, 100.0 / focal_px, 1.0)
    return [value and (s * (value[0] - r), s * value[1])
            for value, r, s in zip(found(run.stdout), right, scale)] + [lens_of(run.stdout)]


def cell(values, runs):
    """rms error (rms in sigmas), and how many of the runs have it if not all."""
    if not values:
        return "-"
    errors = np.array(values)
    text = "%.2f (%.2f)" % (np.sqrt(np.mean(errors[:, 0]**2)),
                            np.sqrt(np.mean((errors[:, 0] / errors[:, 1])**2)))
    return text if len(values) == runs else text + ", %d of %d" % (len(values), runs)


def lens_cell(lenses):
    """Range of what the lens makes up for, and how many are called what."""
    if not lenses:
        return "-"
    gains, verdicts = zip(*lenses)
    return "%.1f to %.1f %%; %d stabilised, %d not" % (
        min(gains), max(gains), verdicts.count("stabilised"), verdicts.count("not stabilised"))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--duration_s", type=float, default=20.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("changes", nargs="*")
    options = parser.parse_args()
    print("| Motion | refused | delay [ms] | focal length [%] | readout [ms] | lens |")
    print("| --- | --- | --- | --- | --- | --- |")
    with ThreadPoolExecutor(options.jobs) as pool:
        for scenario in SCENARIOS:
            runs = list(pool.map(lambda seed, s=scenario: measure(
                options.camgyro, s, seed, options.duration_s, options.changes),
                                 range(1, options.seeds + 1)))
            good = [run for run in runs if run]
            cells = [cell([run[k] for run in good if run[k]], len(good)) for k in range(3)]
            cells.append(lens_cell([run[3] for run in good if run[3]]))
            print("| %s | %d | %s |" % (scenario.split("_")[1], len(runs) - len(good),
                                        " | ".join(cells)), flush=True)


if __name__ == "__main__":
    sys.exit(main())
