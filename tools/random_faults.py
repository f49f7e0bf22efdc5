#!/usr/bin/python3
"""Calibrates simulated recordings with faults that loggers, trackers and drivers make, at random
places, and prints how the errors compare with sigma_total:

    tools/random_faults.py [--seeds A-B] [--duration S] [--motions NAME,...] [--faults NAME,...]
                           [--jobs N] [--camgyro PATH] [--library PREPARE_VIO | --diagnose]
                           [--keep DIR] [KEY=VALUE ...]

--library: with the library, through this build of examples/recording, instead of `calibrate`; its
sigma_total is that of noise where it has not come so far as to find it. --diagnose: with `diagnose`,
whose effects and structure that none explains are printed too: whether it takes a fault for one.
--keep: every recording and what was made of it stay in DIR/NUMBER_OF_FAULT/MOTION_SEED.

The devices have no effect that the model lacks, and nobody declares the fault. KEY=VALUE changes
the scenario of all recordings, as in `camgyro simulate`. Prints a row for each fault: recordings
that were calibrated and whose focal length, readout time and delay are all determined, part of the
determined parameters within 3 sigma_total, their rms errors in sigma_total and in sigmas of noise,
the medians of the errors' size of f, t_r and t_d, the recordings with a doubt, and the time of a
calibration. Below the table: errors beyond 3 sigma_total, refusals, effects that
the program fitted of its own accord, and doubts, one line each, what frames that a fit has not seen
leave over those that it has (quality: unseen_ratio), and how far the frames' own times
(frame_times.csv) are off, about their median, of frames that are late by more than 2 ms and of the
others: rms in ms and in sigmas.
"""
import argparse
import contextlib
import os
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import yaml
from scipy.stats import sigmaclip

from calibration_errors import NAMES, errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SHOWN = ("f", "t_r", "t_d")
LATE_NS = 2000000


def mean_lateness_s(before_ns, after_ns):
    """What late stamps are of the delay by definition: it is that of the mean stamp, but for frames
    that are later by more than five standard deviations of the others."""
    late_s = 1e-9 * (np.array(after_ns) - np.array(before_ns))
    return float(np.mean(sigmaclip(late_s, 5.0, 5.0).clipped))


class Recorded:
    """A recording of tracks in the EuRoC layout, in memory: stamps_ns of frames; tracks: for each a
    list of (id, u, v); gyro_ns and gyro, n x 6 (rad/s, m/s^2)."""

    def __init__(self, folder):
        self.folder = folder
        with open(folder + "/cam0/data.csv", encoding="utf-8") as file:
            rows = [line.split(",", 1) for line in file if line[0].isdigit()]
        self.stamps_ns = [int(row[0]) for row in rows]
        self.rest = [row[1] for row in rows]
        index = {stamp: i for i, stamp in enumerate(self.stamps_ns)}
        self.tracks = [[] for _ in self.stamps_ns]
        with open(folder + "/cam0/tracks.csv", encoding="utf-8") as file:
            for line in file:
                if line[0].isdigit():
                    stamp, track, u, v = line.split(",")
                    self.tracks[index[int(stamp)]].append((int(track), float(u), float(v)))
        with open(folder + "/imu0/data.csv", encoding="utf-8") as file:
            self.head = next(file)
            rows = [line.split(",") for line in file]
        self.gyro_ns = [int(row[0]) for row in rows]
        self.gyro = np.array([[float(cell) for cell in row[1:]] for row in rows])

    def keep_frames(self, keep):
        for name in ("stamps_ns", "rest", "tracks"):
            setattr(self, name, [x for x, kept in zip(getattr(self, name), keep) if kept])

    def keep_samples(self, keep):
        self.gyro_ns = [x for x, kept in zip(self.gyro_ns, keep) if kept]
        self.gyro = self.gyro[np.asarray(keep)]

    def write(self):
        with open(self.folder + "/cam0/data.csv", "w", encoding="utf-8") as file:
            file.writelines("%d,%s" % row for row in zip(self.stamps_ns, self.rest))
        with open(self.folder + "/cam0/tracks.csv", "w", encoding="utf-8") as file:
            for stamp, points in zip(self.stamps_ns, self.tracks):
                file.writelines("%d,%d,%.9f,%.9f\n" % (stamp, *point) for point in points)
        with open(self.folder + "/imu0/data.csv", "w", encoding="utf-8") as file:
            file.write(self.head)
            for stamp, row in zip(self.gyro_ns, self.gyro):
                file.write("%d,%s\n" % (stamp, ",".join("%.9g" % x for x in row)))


def frames_repeat(r, random, part):
    for i in np.flatnonzero(random.uniform(size=len(r.tracks)) < part):
        if i > 0:
            r.tracks[i] = r.tracks[i - 1]


def picture_freezes(r, random, seconds):
    begin = random.integers(len(r.tracks) // 4, len(r.tracks) // 2)
    for i in range(begin, begin + int(30 * seconds)):
        r.tracks[i] = r.tracks[begin]


def frames_are_late(r, random, part):
    for i in np.flatnonzero(random.uniform(size=len(r.tracks)) < part):
        if i + 1 < len(r.stamps_ns):
            r.stamps_ns[i] = min(r.stamps_ns[i] + int(1e9 * random.uniform(0.005, 0.03)),
                                 r.stamps_ns[i + 1] - 1000)


def every_other_frame_is_late(r, _, late_s):
    """As of pictures that a screen's clock holds back: 24 frames/s at 60 Hz."""
    for i in range(1, len(r.stamps_ns), 2):
        r.stamps_ns[i] += int(1e9 * late_s)


def frames_are_lost(r, random, bursts):
    keep = np.ones(len(r.tracks), dtype=bool)
    for begin in random.integers(0, len(keep) - 30, bursts):
        keep[begin:begin + random.integers(5, 30)] = False
    r.keep_frames(keep)


def tracker_is_lost(r, random, part):
    """All points of some frames are anywhere."""
    for i in np.flatnonzero(random.uniform(size=len(r.tracks)) < part):
        r.tracks[i] = [(track, random.uniform(0, 640), random.uniform(0, 480))
                       for track, _, _ in r.tracks[i]]


def identities_restart(r, _, every):
    """A tracker that begins to count anew: the same number is another point then."""
    for begin in range(0, len(r.tracks), every):
        names = {}
        for i in range(begin, min(begin + every, len(r.tracks))):
            r.tracks[i] = [(names.setdefault(track, len(names)), u, v) for track, u, v in r.tracks[i]]


def whole_pixels(r, _, step):
    r.tracks = [[(track, step * round(u / step), step * round(v / step)) for track, u, v in points]
                for points in r.tracks]


def gyro_spikes(r, random, part):
    for i in np.flatnonzero(random.uniform(size=len(r.gyro_ns)) < part):
        r.gyro[i, random.integers(3)] = random.uniform(-35, 35)


def gyro_is_stale(r, random, part):
    """Read before there is a new sample."""
    for i in np.flatnonzero(random.uniform(size=len(r.gyro_ns)) < part):
        if i > 0:
            r.gyro[i] = r.gyro[i - 1]


def gyro_reads_zero(r, random, part):
    for i in np.flatnonzero(random.uniform(size=len(r.gyro_ns)) < part):
        r.gyro[i] = 0.0


def gyro_axis_sticks(r, random, seconds):
    begin = random.integers(len(r.gyro_ns) // 4, len(r.gyro_ns) // 2)
    axis = random.integers(3)
    r.gyro[begin:begin + int(200 * seconds), axis] = r.gyro[begin, axis]


def gyro_gaps(r, random, count):
    keep = np.ones(len(r.gyro_ns), dtype=bool)
    for begin in random.integers(0, len(keep) - 100, count):
        keep[begin:begin + random.integers(4, 100)] = False
    r.keep_samples(keep)


def stamps_are_rounded(r, _, step_s):
    step_ns = int(1e9 * step_s)
    r.stamps_ns = [step_ns * round(x / step_ns) for x in r.stamps_ns]
    r.gyro_ns = [step_ns * round(x / step_ns) for x in r.gyro_ns]


FAULTS = {
    "none": None,
    "1 % of the pictures repeat the one before": (frames_repeat, 0.01),
    "10 % of the pictures repeat the one before": (frames_repeat, 0.1),
    "the picture freezes for 1 s": (picture_freezes, 1.0),
    "3 % of the frames are 5 to 30 ms late": (frames_are_late, 0.03),
    "30 % of the frames are 5 to 30 ms late": (frames_are_late, 0.3),
    "every other frame is 8 ms late": (every_other_frame_is_late, 0.008),
    "three times, up to 1 s of frames is lost": (frames_are_lost, 3),
    "all points of 1 % of the frames are wrong": (tracker_is_lost, 0.01),
    "numbers of points begin anew every 50 frames": (identities_restart, 50),
    "points are rounded to whole pixels": (whole_pixels, 1.0),
    "0.1 % of the gyro's samples are spikes": (gyro_spikes, 0.001),
    "1 % of the gyro's samples are spikes": (gyro_spikes, 0.01),
    "5 % of the gyro's samples are the one before": (gyro_is_stale, 0.05),
    "1 % of the gyro's samples are zero": (gyro_reads_zero, 0.01),
    "an axis of the gyro sticks for 1 s": (gyro_axis_sticks, 1.0),
    "five gaps of up to 0.5 s in the gyro": (gyro_gaps, 5),
    "stamps are rounded to 1 ms": (stamps_are_rounded, 0.001),
    "stamps are rounded to 5 ms": (stamps_are_rounded, 0.005),
    "stamps are rounded to 10 ms": (stamps_are_rounded, 0.01),
    "stamps are rounded to 15.625 ms": (stamps_are_rounded, 0.015625),
}


def read(path):
    with open(path, encoding="utf-8") as file:
        return yaml.safe_load(file)


def judgement(diagnosis):
    """What a diagnosis has found, in lines."""
    lines = ["added: %s (%s)" % (r["added"], r["candidates"][0]["shape"])
             for r in diagnosis["rounds"] if r["added"] != "none"]
    if diagnosis["verdict"]["unexplained_structure"]:
        lines.append("structure that no effect explains")
    return lines


def errors_of_times(out, before_ns, after_ns):
    """Of frames' own times: whether the fault has made them late, errors [s], and these in sigmas."""
    if not os.path.exists(out + "/frame_times.csv"):
        return None
    found = np.loadtxt(out + "/frame_times.csv", delimiter=",", dtype=np.int64, ndmin=2)
    index = {stamp: i for i, stamp in enumerate(after_ns)}
    of = [index[row[0]] for row in found]
    truth = np.array(before_ns)[of]
    lateness = np.array(after_ns)[of] - truth
    error = 1e-9 * (found[:, 1] - truth)
    error -= np.median(error)
    return lateness - np.median(lateness) > LATE_NS, error, error / (1e-9 * found[:, 2])


def describe_times(results):
    late, error, z = (np.concatenate(part) for part in zip(*results))
    return ", ".join("%d %s %.2f ms, %.2f sigmas" % (
        np.sum(some), name, 1e3 * np.sqrt(np.mean(error[some]**2)), np.sqrt(np.mean(z[some]**2)))
        for some, name in ((late, "late frames"), (~late, "others")) if np.any(some))


def folder_of(options, name):
    if not options.keep:
        return tempfile.TemporaryDirectory()
    folder = os.path.join(options.keep, name)
    os.makedirs(folder, exist_ok=True)
    return contextlib.nullcontext(folder)


def run(options, fault, seed):
    motion = options.motions[seed % len(options.motions)]
    with folder_of(options, "%d/%s_%d" % (list(FAULTS).index(fault), motion, seed)) as folder:
        recording, out = folder + "/recording", folder + "/out"
        with open(folder + "/scenario.yaml", "w", encoding="utf-8") as file:
            yaml.safe_dump({"seed": seed, "duration_s": options.duration, "motion": {"kind": motion},
                            "camera": {"resolution": [640, 480], "focal_px": 500},
                            "tracks": {"noise_px": 0.3, "outlier_fraction": 0.02}}, file)
        subprocess.run([options.camgyro, "simulate", folder + "/scenario.yaml", *options.changes,
                        "--out", recording], check=True, stdout=subprocess.DEVNULL)
        late_s = 0.0
        if FAULTS[fault]:
            make, size = FAULTS[fault]
            recorded = Recorded(recording)
            stamps_ns = list(recorded.stamps_ns)
            make(recorded, np.random.default_rng([seed, 7]), size)
            if len(stamps_ns) == len(recorded.stamps_ns):
                late_s = mean_lateness_s(stamps_ns, recorded.stamps_ns)
            recorded.write()
        begin_s = time.monotonic()
        command = ([options.library, recording, out] if options.library else
                   [options.camgyro, "diagnose" if options.diagnose else "calibrate", recording,
                    "--out", out])
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        result = {"name": "%s %d" % (motion, seed), "seconds": time.monotonic() - begin_s,
                  "says": [line for line in done.stdout.split("\n") if line.startswith("doubt")]}
        if not os.path.exists(out + "/calibration.yaml"):
            result["refused"] = done.stderr.strip().split("\n")[-1]
            return result
        calibration, truth = read(out + "/calibration.yaml"), read(recording + "/truth.yaml")
        truth["clock"]["delay_s"]["value"] -= late_s
        result["unseen"] = calibration["quality"].get("unseen_ratio")
        result["fitted"] = ["%s:%s" % (e["name"], e["shape"]) for e in calibration.get("effects", [])]
        if options.diagnose:
            result["says"] += judgement(read(out + "/diagnosis.yaml"))
        if FAULTS[fault] and len(stamps_ns) == len(recorded.stamps_ns):
            result["times"] = errors_of_times(out, stamps_ns, recorded.stamps_ns)
        error, noise = errors(calibration, truth)
        unknown = calibration["quality"]["unobservable"]
        used = np.array([name not in unknown for name in calibration["covariance"]["order"]])
        total = noise  # of a library that has not come so far as to find it
        if "total" in calibration["covariance"]:
            total = np.sqrt(np.diag(np.array(calibration["covariance"]["total"])))
        result.update(error=error, used=used, z=np.where(used, error / total, np.nan),
                      z_noise=np.where(used, error / noise, np.nan))
        return result


def print_row(fault, results):
    """Returns what is to be said of single recordings."""
    notes = ["%s: %s refused: %s" % (fault, r["name"], r["refused"]) for r in results if "refused" in r]
    found = [r for r in results if "refused" not in r]
    shown = [NAMES.index(name) for name in SHOWN]
    good = sum(bool(r["used"][shown].all()) for r in found)
    cells = ["-"] * 6
    if any(r["used"].any() for r in found):
        z, z_noise = (np.array([r[key] for r in found]) for key in ("z", "z_noise"))
        sizes = np.median(np.abs([r["error"] for r in found]), axis=0)[shown]
        cells = ["%.1f %%" % (100 * np.mean(np.abs(z[np.isfinite(z)]) < 3)),
                 "%.2f" % np.sqrt(np.nanmean(z**2)), "%.2f" % np.sqrt(np.nanmean(z_noise**2)),
                 "%.2f" % sizes[0], "%.3f" % (1e3 * sizes[1]), "%.3f" % (1e3 * sizes[2])]
    print("| %s | %d of %d | %s | %d | %.1f |" % (
        fault, good, len(results), " | ".join(cells), sum(bool(r["says"]) for r in results),
        np.median([r["seconds"] for r in results])), flush=True)
    ratios = [r["unseen"] for r in found if r["unseen"] is not None]
    if ratios:
        notes.append("%s: unseen frames leave %.2f to %.2f times what seen ones do" % (
            fault, min(ratios), max(ratios)))
    times = [r["times"] for r in found if r.get("times")]
    if times:
        notes.append("%s: frames' own times: %s" % (fault, describe_times(times)))
    for r in found:
        off = [pair for pair in zip(NAMES, r["z"]) if abs(pair[1]) > 3]
        if off:
            notes.append("%s: %s beyond 3 sigma_total: %s" % (
                fault, r["name"], ", ".join("%s %.1f" % pair for pair in off)))
        if not r["used"][shown].all():
            notes.append("%s: %s not determined" % (fault, r["name"]))
        if r["fitted"]:
            notes.append("%s: %s fitted as well: %s" % (fault, r["name"], ", ".join(r["fitted"])))
        notes += ["%s: %s %s" % (fault, r["name"], line) for line in r["says"]]
    return notes


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1-6")
    parser.add_argument("--duration", type=float, default=15.0)
    parser.add_argument("--motions", default="walking,running,handheld")
    parser.add_argument("--faults", help="those whose name contains one of these words")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    program = parser.add_mutually_exclusive_group()
    program.add_argument("--library")
    program.add_argument("--diagnose", action="store_true")
    parser.add_argument("--keep")
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE")
    options = parser.parse_args()
    options.motions = options.motions.split(",")
    first, last = (options.seeds.split("-") * 2)[:2]
    seeds = range(int(first), int(last) + 1)
    wanted = options.faults.split(",") if options.faults else [""]
    notes = []
    print("| fault | determined | within 3 sigma_total | rms error in sigma_total | in sigma of noise "
          "| error of f [px] | of t_r [ms] | of t_d [ms] | doubted | time [s] |")
    print("| --- " * 10 + "|")
    with ThreadPoolExecutor(options.jobs) as pool:
        for fault in FAULTS:
            if any(word in fault for word in wanted):
                notes += print_row(fault, list(pool.map(lambda seed: run(options, fault, seed), seeds)))
    print("\n" + "\n".join(notes))


if __name__ == "__main__":
    main()
