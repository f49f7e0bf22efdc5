#!/usr/bin/python3
"""Calibrates changed copies of the measured recordings and compares with what is known of them, or
else with what the recording as it is gives:

    tools/measure_variants.py [--camgyro PATH] [--keep FOLDER] [--only WORD] [--jobs N]

The copies are parts, or have fewer frames or samples, stamps in whole ms, a gyro with other axes,
pictures that are turned, a later clock or another guess of the focal length: none of it changes
what is true, but in the way that is accounted for. Prints for each copy its main values, the number
of parameters that are determined, and those that are beyond 3 sigma_total; then the table of
docs/lab/variants.md. With --keep, results stay in FOLDER, and those that are there are not made
again; --only takes the recordings whose name contains WORD. Needs numpy, yaml and PIL.
"""
import argparse
import concurrent.futures
import os
import random
import re
import tempfile

import numpy as np
import yaml
from PIL import Image

import measure
from calibration_errors import NAMES, multiply
from recording_copy import copy_recording, frame_stamps

# Recordings that calibrate as they are, with their flags. Left out: videos in mp4, which cannot be
# changed without encoding them anew, and iphone-cards, which determines nothing.
RECORDINGS = (
    [(name, "") for name in ("phone-cc9-street", "euroc-v101-flight", "phone-edge-hand")]
    + [(name, "--device=industrial") for name in ("ov_handheld_gs", "ov_handheld_rs")]
    + [(name, measure.FOUND_LENS) for name in ("ov_corridor_rs", "ov_corridor_rs_klt", "ov_mav_gs")]
    + [(name, "") for name in ("tablet-attitude/D01", "tablet-attitude/D04", "tablet-attitude/D10",
                               "tango-walk/imu3", "arkit-attitude/demo1")])

TURN_Q = (0.5, 0.5, 0.5, 0.5)  # the gyro's axes in turn: x becomes y, y becomes z, z becomes x
LATE_NS = 300_000_000
MS_NS = 1_000_000


def part(number, parts):
    def make(recording, folder):
        stamps = frame_stamps(recording)
        begin, end = (len(stamps) * p // parts for p in (number, number + 1))
        kept = set(stamps[begin:end])
        return copy_recording(recording, folder, keep=kept.__contains__)
    return make


def every(step):
    def make(recording, folder):
        kept = set(frame_stamps(recording)[::step])
        return copy_recording(recording, folder, keep=kept.__contains__)
    return make


def dropped_frames(recording, folder):
    chance = random.Random(1)
    kept = {s for s in frame_stamps(recording) if chance.random() > 0.3}
    return copy_recording(recording, folder, keep=kept.__contains__)


def half_the_samples(recording, folder):
    return copy_recording(recording, folder, gyro=lambda i, row: row if i % 2 == 0 else None)


def whole_ms(recording, folder):
    def rounded(ns):
        return round(ns / MS_NS) * MS_NS
    return copy_recording(recording, folder, stamp=rounded,
                          gyro=lambda i, row: [str(rounded(int(row[0].split(".")[0])))] + row[1:])


def without_mounting(text):
    return re.sub(r"(?m)^T_BS:\n(?:[ \t]+.*\n?)+", "", text)


def other_axes(recording, folder):
    def row_of(_, row):
        return [row[0], row[3], row[1], row[2]] + (
            [row[6], row[4], row[5]] if len(row) >= 7 else []) + row[7:]
    return copy_recording(recording, folder, gyro=row_of, sensor=without_mounting)


def half_turn(recording, folder):
    """The last row becomes the first, and is read last all the same."""
    copy_recording(recording, folder, sensor=without_mounting)
    width, height = size_of(recording)
    camera = os.path.join(folder, "cam0")
    tracks = os.path.join(camera, "tracks.csv")
    if os.path.exists(tracks):
        with open(tracks, encoding="utf-8") as file:
            lines = file.read().splitlines()
        os.remove(tracks)
        with open(tracks, "w", encoding="utf-8") as out:
            for line in lines:
                cells = line.split(",")
                if line[:1].isdigit():
                    cells[2:4] = ["%.3f" % (size - 1 - float(cell))
                                  for size, cell in zip((width, height), cells[2:4])]
                out.write(",".join(cells) + "\n")
    pictures = os.path.join(camera, "data")
    if os.path.exists(pictures):
        source = os.readlink(pictures)
        os.remove(pictures)
        os.makedirs(pictures)
        for name in os.listdir(source):
            with Image.open(os.path.join(source, name)) as picture:
                picture.transpose(Image.Transpose.ROTATE_180).save(
                    os.path.join(pictures, name), **(
                        {"quality": 97} if name.endswith(".jpg") else {"compress_level": 1}))
    return folder


def late_frames(recording, folder):
    return copy_recording(recording, folder, stamp=lambda ns: ns + LATE_NS)


def guess(factor):
    def focal(match):
        fx, fy, rest = match.group(1).split(",", 2)
        return "intrinsics: [%.1f, %.1f,%s" % (factor * float(fx), factor * float(fy), rest)
    def make(recording, folder):
        return copy_recording(recording, folder, sensor=lambda text: re.sub(
            r"(?m)^intrinsics: *\[(.*)", focal, text))
    return make


VARIANTS = {
    "as it is": None, "first third": part(0, 3), "middle third": part(1, 3),
    "last third": part(2, 3), "every second frame": every(2), "every third frame": every(3),
    "30 % of the frames dropped": dropped_frames, "every second sample": half_the_samples,
    "stamps in whole ms": whole_ms, "gyro with other axes": other_axes,
    "picture turned by half a turn": half_turn,
    "frames 300 ms later": late_frames, "f guessed at 0.7": guess(0.7),
    "f guessed at 1.5": guess(1.5)}


def sensor_of(recording):
    path = os.path.join(recording, "cam0/sensor.yaml")
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return yaml.safe_load(file)


def size_of(recording):
    return sensor_of(recording)["resolution"]


def makes_sense(recording, variant):
    """Whether the recording has what the variant changes."""
    needs = "intrinsics" if "guessed" in variant else "resolution" if "picture" in variant else None
    return needs is None or needs in sensor_of(recording)


def expected(known, variant, recording):
    """What is true of a copy, if `known` is of the recording."""
    known = dict(known)
    if variant == "picture turned by half a turn":
        size = size_of(recording)
        for name, pixels in (("c_x", size[0]), ("c_y", size[1])):
            if name in known:
                known[name] = pixels - 1 - np.array(known[name])
        if "t_d" in known and "t_r" in known:
            known["t_d"] = np.array(known["t_d"]) + known["t_r"] * (size[1] - 1) / size[1]
        else:
            known.pop("t_d", None)
        if "t_r" in known:
            known["t_r"] = -known["t_r"]
        for key in ("q", "other_q"):
            if key in known:
                known[key] = multiply(known[key], (0.0, 0.0, 0.0, 1.0))
    if variant == "frames 300 ms later" and "t_d" in known:
        known["t_d"] = np.array(known["t_d"]) - 1e-9 * LATE_NS
    if variant == "gyro with other axes":
        biases = [known.pop(name, None) for name in ("b_z", "b_x", "b_y")]
        known.update({name: b for name, b in zip(("b_x", "b_y", "b_z"), biases) if b is not None})
        for key in ("q", "other_q"):
            if key in known:
                known[key] = multiply(TURN_Q, known[key])
    return known


def known_from(base, known):
    """What is known of a recording, and where nothing is, what it gives as it is."""
    all_of_it = {name: base["values"][i] for i, name in enumerate(NAMES[:8])
                 if base["determined"][i] and np.isfinite(base["values"][i])}
    if base["determined"][8:].all():
        all_of_it["q"] = base["q"]
    return {**all_of_it, **{k: v for k, v in known.items() if k != "axes"}}


def row_of(variant, known, recording, r):
    """The cells of a copy: outcome, parameters that are determined, those beyond 3 sigma_total."""
    if "values" not in r:
        return [variant, r["message"].replace("camgyro: ", ""), "", ""], []
    if r["total"] is None:  # too little for one
        r = {**r, "total": r["sigma"]}
    z = measure.errors_in_total(expected(known, variant, recording), r)
    z = np.where(r["determined"], z, np.nan)
    beyond = ["%s %+.1f" % (NAMES[i], e) for i, e in enumerate(z) if abs(e) > 3]
    values = ", ".join("%s %.*f ± %.*f" % (
        NAMES[i], measure.DIGITS[i], measure.SCALE[i] * r["values"][i],
        measure.DIGITS[i], measure.SCALE[i] * r["total"][i])
                       for i in (0, 3, 4) if r["determined"][i] and np.isfinite(r["values"][i]))
    return [variant, "exit code %d" % r["exit_code"] if r["exit_code"] else values or "-",
            str(int(np.sum(r["determined"]))), ", ".join(beyond)], list(z[~np.isnan(z)])


def counts(z):
    """Cells: parameters, how many are within 3 sigma_total, and their rms in sigma_total."""
    z = np.array(z)
    return [str(len(z)), str(int(np.sum(np.abs(z) < 3))), "%.2f" % np.sqrt(np.mean(z**2))]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--camgyro", default=measure.SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--keep", help="folder of results")
    parser.add_argument("--only", default="", metavar="WORD")
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    camgyro = os.path.abspath(options.camgyro)

    def run(job):
        (name, flags), variant, folder = job
        recording, copy = os.path.join(measure.DATA, name), os.path.join(folder, "recording")
        result = os.path.join(folder, "result")
        if VARIANTS[variant] is not None and not os.path.exists(copy):
            VARIANTS[variant](recording, copy)
        r = measure.run(camgyro, recording if VARIANTS[variant] is None else copy, flags, result)
        print("%s, %s: exit code %d, %.0f s CPU" % (name, variant, r["exit_code"], r["cpu_s"]),
              flush=True)
        return r

    all_z, summary = [], []
    with tempfile.TemporaryDirectory() as temporary, \
            concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        jobs = [((name, flags), variant, os.path.join(
                    options.keep or temporary, re.sub(r"\W+", "_", name + " " + variant)))
                for name, flags in RECORDINGS if options.only in name for variant in VARIANTS
                if makes_sense(os.path.join(measure.DATA, name), variant)]
        results = {(job[0][0], job[1]): r for job, r in zip(jobs, pool.map(run, jobs))}
    knowns = {name: known for name, flags, known in measure.RECORDINGS}
    for name, flags in RECORDINGS:
        if options.only not in name:
            continue
        recording = os.path.join(measure.DATA, name)
        known = known_from(results[name, "as it is"], measure.known_of(name, knowns[name]))
        rows, of_recording = [], []
        for variant in VARIANTS:
            if (name, variant) in results:
                row, z = row_of(variant, known, recording, results[name, variant])
                rows.append(row)
                of_recording += z
        title = name + (", `%s`" % flags if flags else "")
        print("## %s\n\n%s" % (title, measure.table(
            ["Copy", "f [px], t_r, t_d [ms] ± sigma_total", "Determined", "Beyond 3 sigma_total"],
            rows)))
        summary.append([title, str(len(rows)), *counts(of_recording), "; ".join(
            "%s: %s" % (row[0], row[3] or row[1]) for row in rows if row[3] or not row[2])])
        all_z += of_recording
    summary.append(["all", str(len(results)), *counts(all_z), ""])
    print(measure.table(["Recording", "Copies", "Parameters", "Within 3 sigma_total", "rms",
                         "Beyond, or refused"], summary))


if __name__ == "__main__":
    main()
