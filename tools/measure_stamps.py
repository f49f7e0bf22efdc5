#!/usr/bin/python3
"""Calibrates simulated recordings whose stamps are times of arrival, and prints how far off the
calibrations are, and whether it was found:

    tools/measure_stamps.py [--seeds A-B] [--sizes NAME,...] [--motions NAME,...] [--duration S]
                            [--jobs N] [--store FILE.jsonl] [--camgyro PATH] [--print]

Every run becomes a line of the store, with the commit of the sources; what is there is not run
again, so that a long series can be made in parts. --print only prints the tables of what is there.

A mean latency is no error of a calibration: nothing tells it from the delay t_d. The truth of t_d is
what docs/recording_format.md defines: a gyro whose median stamp is on time, and a camera whose mean
stamp is. Both latencies are taken of their law, since a sigma says how far another recording's delay
would be off; beside it stands the error of t_d against the gyro's clock of this very recording, and
the camera's, which is what its own frames need.
"""
import argparse
import json
import os
import subprocess
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np
import yaml

from calibration_errors import NAMES, errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
MOTIONS = ("handheld", "walking", "running", "panning", "slow")
PICTURES = "pictures"  # of a room, rendered and tracked, instead of a motion
# Name: mean latency of the frames, mean latency and longest stall of the gyro's samples, and the
# part of the frames' latency that wanders, with a correlation time of 1.5 s [ms].
SIZES = {
    "clean": (0, 0, 0),
    "frames 0.5": (0.5, 0, 0),
    "frames 2": (2, 0, 0),
    "frames 5": (5, 0, 0),
    "gyro 1": (0, 1, 0),
    "gyro 3, stalls 30": (0, 3, 30),
    "gyro 10": (0, 10, 0),
    "gyro 30": (0, 30, 0),
    "both 0.5, 1": (0.5, 1, 0),
    "both 2, 3, stalls 30": (2, 3, 30),
    "both 5, 30": (5, 30, 0),
    "frames 1.5, wander 3": (1.5, 0, 0, 3),
}
GYRO_HZ, STALL_EVERY = 200.0, 200
SEEDS_APART = 1000  # of the motions, so that no two recordings share their random numbers


def read(path):
    with open(path, encoding="utf-8") as file:
        return yaml.safe_load(file)


def arrivals_s(latency_s, stall_s, rate_hz, count, random):
    """Latencies of samples that arrive in order, as simulation/gyro.cc draws them."""
    times = np.arange(count) / rate_hz
    late = latency_s * random.exponential(size=count)
    late += stall_s * random.uniform(size=count) * (random.uniform(size=count) * STALL_EVERY < 1)
    return np.maximum.accumulate(times + late) - times


def usual_median_s(size):
    """Median latency of the gyro's samples, by the law: known to 0.2 % of it."""
    latency_s, stall_s = 1e-3 * size[1], 1e-3 * size[2]
    if not latency_s:
        return 0.0
    return float(np.median(arrivals_s(latency_s, stall_s, GYRO_HZ, 2000000, np.random.default_rng(1))))


def latencies_of(recording):
    """Median latency of the gyro's samples in this recording, and mean one of its frames [s]."""
    stamps = np.loadtxt(recording + "/imu0/data.csv", delimiter=",", usecols=0, dtype=np.int64)
    sampled = stamps[0] + np.round(1e9 / GYRO_HZ * np.arange(len(stamps))).astype(np.int64)
    delays = np.loadtxt(recording + "/truth_trajectory.csv", delimiter=",", usecols=9)
    return 1e-9 * float(np.median(stamps - sampled)), delays


def frames_in_sigmas(out, recording, shift_s, delay_sigma_s):
    """Rms of the errors of the frames' own times [s], their mean square in sigmas, with that of the
    delay, which all frames share, and the largest in sigmas beside their median."""
    if not os.path.exists(out + "/frame_times.csv"):
        return None
    found = np.loadtxt(out + "/frame_times.csv", delimiter=",", dtype=np.int64, ndmin=2)
    truth = np.loadtxt(recording + "/truth_trajectory.csv", delimiter=",", usecols=(0, 8),
                       dtype=np.int64)
    first_row = {stamp: time for time, stamp in truth}
    error = np.array([(row[1] - first_row[row[0]]) * 1e-9 for row in found]) + shift_s
    return [float(np.sqrt(np.mean(error**2))),
            float(np.mean(error**2 / ((1e-9 * found[:, 2])**2 + delay_sigma_s**2))),
            float(np.max(np.abs(error - np.median(error)) / (1e-9 * found[:, 2])))]


def run(options, case):
    name, motion, seed = case
    size = SIZES[name]
    with tempfile.TemporaryDirectory() as folder:
        recording, out = folder + "/recording", folder + "/out"
        subprocess.run(
            [options.camgyro, "simulate", SOURCE + "/tools/scenarios/" +
             ("video_room.yaml" if motion == PICTURES else "motion_%s.yaml" % motion),
             "seed=%d" % (SEEDS_APART * (*MOTIONS, PICTURES).index(motion) + seed),
             "duration_s=%g" % options.duration, "tracks.noise_px=0.5",
             "tracks.outlier_fraction=0.02", "gyro.rate_hz=%g" % GYRO_HZ,
             "effects.frame_stamp_jitter.latency_s=%g" % (1e-3 * size[0]),
             "gyro.stamp_latency_s=%g" % (1e-3 * size[1]),
             "gyro.stamp_stall_s=%g" % (1e-3 * size[2]),
             "effects.frame_stamp_jitter.wander_s=%g" % (1e-3 * sum(size[3:])), "--out", recording],
            check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        done = subprocess.run([options.camgyro, "calibrate", recording, "--out", out, "--quiet"],
                              capture_output=True, text=True, check=False)
        result = dict(size=name, motion=motion, seed=seed, exit=done.returncode)
        if not os.path.exists(out + "/calibration.yaml"):
            return dict(result, refused=done.stderr.strip().split("\n")[-1])
        calibration = read(out + "/calibration.yaml")
        truth = read(recording + "/truth.yaml")
        median_s, delays = latencies_of(recording)
        delay = truth["clock"]["delay_s"]
        here_s = float(np.mean(delays)) + median_s
        delay["value"] += options.medians[name] - 1e-3 * size[0]
        error, sigma = errors(calibration, truth)
        focal = truth["camera"]["focal_px"]["value"]
        known = np.array([n not in calibration["quality"]["unobservable"]
                          for n in calibration["covariance"]["order"]])
        matrix = np.array(calibration["covariance"]["matrix"])[:len(NAMES), :len(NAMES)]
        used, matrix = error[known], matrix[np.ix_(known, known)]
        return dict(
            result, z=[float(v) for v in error / sigma], known=[bool(v) for v in known],
            nees=float(used @ np.linalg.solve(matrix, used) / max(1, known.sum())),
            focal=float(error[0] / focal), readout_s=float(error[3]), delay_s=float(error[4]),
            delay_sigma_s=float(sigma[4]),
            delay_here_s=float(calibration["clock"]["delay_s"]["value"] - here_s),
            gyro=calibration["stamps"]["gyro"]["kind"],
            camera=calibration["stamps"]["camera"]["kind"],
            effects=[{p["name"]: p["value"] for p in e["parameters"]}
                     for e in calibration.get("effects", [])],
            halves="halves" in done.stdout + done.stderr,
            frames=frames_in_sigmas(
                out, recording, calibration["clock"]["delay_s"]["value"] - median_s, sigma[4]))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def found(rows, key):
    kinds = Counter(r[key] for r in rows)
    return ", ".join("%s %d" % item for item in kinds.most_common())


def row_of(label, rows):
    """A line of the table."""
    good = [r for r in rows if "refused" not in r]
    if not good:
        return "| %s | %d | refused |" % (label, len(rows))
    nees = np.array([r["nees"] for r in good])
    spread = " ± %.2f" % (nees.std(ddof=1) / np.sqrt(len(nees))) if len(nees) > 1 else ""
    frames = [r["frames"] for r in good if r["frames"]]

    def of(key, number, scale):
        known = [r[key] for r in good if r["known"][number]]
        return "%.3f" % (scale * rms(known)) if known else "-"
    return "| %s | %s | %s | %s | %s | %s | %s | %.2f%s | %s | %s | %s |" % (
        label, "%d" % len(good) + (" of %d" % len(rows) if len(good) < len(rows) else ""),
        of("delay_s", 4, 1e3), of("delay_here_s", 4, 1e3),
        "%.2f" % rms([r["z"][4] for r in good if r["known"][4]] or [np.nan]),
        of("readout_s", 3, 1e3), of("focal", 0, 100), nees.mean(), spread,
        "%.2f, %.2f, %.1f" % (1e3 * rms([f[0] for f in frames]), np.mean([f[1] for f in frames]),
                              max([f[2] for f in frames if len(f) > 2], default=np.nan))
        if frames else "-", found(good, "gyro"), found(good, "camera"))


HEAD = ("| %s | recordings | t_d [ms] | t_d here [ms] | t_d in sigmas | t_r [ms] | f [%%] | NEES/dof "
        "| frames' times [ms], chi2, furthest | gyro's stamps | frames' stamps |\n" + "| --- " * 11 + "|")


def print_tables(rows):
    sizes = [s for s in SIZES if any(r["size"] == s for r in rows)]
    print("Rms errors; commits %s.\n" % ", ".join(
        "%s (%d)" % item for item in Counter(r["commit"] for r in rows).most_common()))
    print(HEAD % "Latency [ms]")
    for size in sizes:
        print(row_of(size, [r for r in rows if r["size"] == size]))
    print("\n" + HEAD % "Latency [ms], motion")
    for size in sizes:
        for motion in (*MOTIONS, PICTURES):
            of = [r for r in rows if r["size"] == size and r["motion"] == motion]
            if of:
                print(row_of(size + ", " + motion, of))


def key_of(row):
    return row["size"], row["motion"], row["seed"]


def commit_of_sources():
    """The last one that changed more than documents and this script."""
    def git(*words):
        return subprocess.run(["git", "-C", SOURCE, *words, "--", ".", ":!docs", ":!tools/*.py"],
                              check=True, capture_output=True, text=True).stdout.strip()
    return git("log", "-1", "--format=%h") + ("+" if git("status", "--porcelain") else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1-10")
    parser.add_argument("--sizes", default=";".join(SIZES), help="separated by semicolons")
    parser.add_argument("--motions", default=",".join(MOTIONS), help="and '%s'" % PICTURES)
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--store", default=SOURCE + "/build/stamps.jsonl")
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--print", action="store_true")
    options = parser.parse_args()
    first, last = (options.seeds.split("-") * 2)[:2]
    options.medians = {name: usual_median_s(size) for name, size in SIZES.items()}
    rows = {}
    if os.path.exists(options.store):
        with open(options.store, encoding="utf-8") as lines:
            rows = {key_of(row): row for row in map(json.loads, lines)}
    cases = [] if options.print else [
        case for seed in range(int(first), int(last) + 1) for motion in options.motions.split(",")
        for size in options.sizes.split(";") if (case := (size, motion, seed)) not in rows]
    commit = commit_of_sources()
    os.makedirs(os.path.dirname(os.path.abspath(options.store)), exist_ok=True)
    with ThreadPoolExecutor(options.jobs) as pool:
        for done in as_completed([pool.submit(run, options, case) for case in cases]):
            row = dict(done.result(), commit=commit)
            rows[key_of(row)] = row
            with open(options.store, "a", encoding="utf-8") as out:
                out.write(json.dumps(row) + "\n")
    print_tables(list(rows.values()))


if __name__ == "__main__":
    main()
