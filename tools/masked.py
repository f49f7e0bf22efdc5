#!/usr/bin/python3
"""Calibrates a recording from the features of parts of the picture, or of the time, only, to see
whether what a calibration says is everywhere in it or comes from one place:

    tools/masked.py [--boxes U0,V0,U1,V1 ...] [--stretches N] [--flags "..."] [--camgyro PATH]
                    RECORDING

Features are tracked once, by `camgyro track`, in all of the picture. A box [px] keeps the
observations inside of it; with --stretches, all of them and those of each box are also taken from
each of N stretches of equal length. Prints a table with sigma and sigma_total.
"""
import argparse
import os
import subprocess
import tempfile

import numpy as np
import yaml

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def read_tracks(path):
    """Stamps [ns], positions [px] (n, 2), and the lines with the header as the first."""
    with open(path, encoding="utf-8") as file:
        lines = file.readlines()
    cells = [line.split(",") for line in lines[1:]]
    return (np.array([int(c[0]) for c in cells]), np.array([[float(c[2]), float(c[3])]
                                                            for c in cells]), lines)


def with_observations(recording, lines, kept, folder):
    """A recording of the tracks' observations that are kept, and of their frames."""
    os.makedirs(folder + "/cam0")
    os.symlink(os.path.abspath(recording + "/imu0"), folder + "/imu0")
    os.symlink(os.path.abspath(recording + "/cam0/sensor.yaml"), folder + "/cam0/sensor.yaml")
    rows = [line for line, keep in zip(lines[1:], kept) if keep]
    with open(folder + "/cam0/tracks.csv", "w", encoding="utf-8") as file:
        file.writelines(lines[:1] + rows)
    with open(folder + "/cam0/data.csv", "w", encoding="utf-8") as file:
        file.write("#timestamp [ns],filename\n")
        file.writelines(stamp + ",\n" for stamp in sorted({row.split(",")[0] for row in rows}))


def parts_of(stamps, at_px, boxes, stretches):
    """(name, mask) of each part."""
    within = [("all", np.ones(len(stamps), bool))]
    for box in boxes:
        low, high = np.array(box.split(","), dtype=float).reshape(2, 2)
        within.append(("%g <= u < %g, %g <= v < %g" % (low[0], high[0], low[1], high[1]),
                       ((at_px >= low) & (at_px < high)).all(axis=1)))
    yield from within
    edges = np.linspace(stamps[0], stamps[-1] + 1, stretches + 1)
    for i in range(stretches if stretches > 1 else 0):
        during = (stamps >= edges[i]) & (stamps < edges[i + 1])
        for name, mask in within:
            yield "%s, stretch %d of %d" % (name, i + 1, stretches), mask & during


def quantity(q, digits, scale=1.0):
    return " ± ".join("%.*f" % (digits, scale * q[key])
                      for key in ("value", "sigma", "sigma_total") if key in q)


def row(name, count, c):
    camera, absent = c["camera"], c["quality"]["unobservable"]
    center = [dict(zip(camera["principal_px"], x)) for x in zip(*camera["principal_px"].values())]
    fitted = ["%s %s %.4g ± %.2g" % (e["name"], p["name"], p["value"], p["sigma"])
              for e in c["effects"] for p in e["parameters"]]
    return [name, str(count), quantity(camera["focal_px"], 1), quantity(center[0], 1),
            quantity(center[1], 1), quantity(c["shutter"]["readout_s"], 2, 1e3),
            "%.3f" % c["quality"]["noise_px"], ", ".join(fitted + (
                ["not determined: " + ", ".join(absent)] if absent else []))]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording")
    parser.add_argument("--boxes", nargs="*", default=[])
    parser.add_argument("--stretches", type=int, default=1)
    parser.add_argument("--flags", default="")
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    options = parser.parse_args()
    head = ["Part", "Observations", "f [px]", "c_x [px]", "c_y [px]", "t_r [ms]", "Noise [px]", ""]
    print("| " + " | ".join(head) + " |\n|" + " --- |" * len(head))
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([options.camgyro, "track", options.recording, "--out", folder + "/tracked"],
                       check=True, stdout=subprocess.DEVNULL)
        stamps, at_px, lines = read_tracks(folder + "/tracked/cam0/tracks.csv")
        for i, (name, kept) in enumerate(parts_of(stamps, at_px, options.boxes,
                                                  options.stretches)):
            part, out = "%s/part%d" % (folder, i), "%s/out%d" % (folder, i)
            with_observations(options.recording, lines, kept, part)
            done = subprocess.run([options.camgyro, "calibrate", part, "--out", out,
                                   *options.flags.split()],
                                  capture_output=True, text=True, check=False)
            cells = [name, str(kept.sum()), done.stderr.strip().split("\n")[-1]]
            if os.path.exists(out + "/calibration.yaml"):
                with open(out + "/calibration.yaml", encoding="utf-8") as file:
                    cells = row(name, kept.sum(), yaml.safe_load(file))
            print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
