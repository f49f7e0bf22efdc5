#!/usr/bin/python3
"""Simulates tracks under the logs of two phones, calibrates them, and writes docs/lab/device_logs.md.

    CAMGYRO_DATA=../shared/data tools/measure_device_logs.py [path of camgyro]

The phones turned, sampled and photographed as they did (../shared/data/timing-*); the lens of one
moved as it logged. What is simulated around them is known: errors are those beside it. The text
before the tables is docs/lab/device_logs_notes.md.
"""
import argparse
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import yaml

from calibration_errors import NAMES, errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DATA = os.environ.get("CAMGYRO_DATA", os.path.join(os.path.dirname(SOURCE), "shared/data"))
SEEDS = (1, 2, 3)
LENS = ["effects.optical_stabilisation.logged_px=0.3175"]
LOGGED = [*LENS, "effects.optical_stabilisation.log_hz=250"]
# Name, scenario, folder, what differs, flags of calibrate.
RUNS = (("Nexus S", "log_nexus_s", "timing-nexus-s", [], []),
        ("Pixel, its lens held", "log_pixel", "timing-pixel-ois", [], []),
        ("Pixel, its lens as logged", "log_pixel", "timing-pixel-ois", LENS, []),
        ("the same, with the log in the recording", "log_pixel", "timing-pixel-ois", LOGGED, []),
        ("the same, `optical_stabilisation:0.5`", "log_pixel", "timing-pixel-ois", LENS,
         ["--effects=optical_stabilisation:0.5"]),
        ("the same, `optical_stabilisation:0.5/0.025`", "log_pixel", "timing-pixel-ois", LENS,
         ["--effects=optical_stabilisation:0.5/0.025"]))
UNITS = {"f": ("px", 1.0), "t_r": ("ms", 1e3), "t_d": ("ms", 1e3)}
# Models of a stabiliser: name, corner frequencies [Hz], stops [rad], whether these are a circle.
MODELS = (("high-pass, no stop", (0.5, 1.0, 2.0, 3.0), (np.inf,), False),
          ("with stops, each axis", (0.3, 0.5, 1.0), (0.02, 0.025, 0.03), False),
          ("with a stop in any direction", (0.15, 0.3, 0.5, 1.0), (0.015, 0.02, 0.025, 0.03, 0.04),
           True))


def simulate(camgyro, run, seed, folder):
    """A recording of a run, in a folder."""
    _, scenario, log, changes, _ = run
    names = ["log.gyro=gyro.csv", "log.frames=frames.csv"]
    names += ["log.lens_shift=ois.csv"] if changes else []
    files = [name.replace("=", "=%s/%s/" % (DATA, log)) for name in names]
    subprocess.run([camgyro, "simulate", "%s/tools/scenarios/%s.yaml" % (SOURCE, scenario),
                    "seed=%d" % seed, *files, *changes, "--out", folder], check=True,
                   stdout=subprocess.DEVNULL)


def measure(camgyro, run, seed):
    """Calibration and truth of a run."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(camgyro, run, seed, folder + "/recording")
        done = subprocess.run([camgyro, "calibrate", folder + "/recording", "--threads=1",
                               "--out", folder + "/out", *run[4]], stdout=subprocess.PIPE,
                              text=True, check=False)
        load = lambda name: yaml.safe_load(open(name, encoding="utf-8"))
        found = load(folder + "/out/calibration.yaml")
        print(run[0], seed, "exit code", done.returncode, flush=True)
        found["doubts"] = doubts(done.stdout)
        return found, load(folder + "/recording/truth.yaml")


def doubts(text):
    """The lines "doubt" of a summary, each with the lines that go on with it."""
    found, inside = [], False
    for line in text.splitlines():
        inside = line.startswith("doubt ") or (inside and line.startswith(" " * 11))
        if line.startswith("doubt "):
            found.append(line[6:].strip())
        elif inside:
            found[-1] += " " + line.strip()
    return found


def row(run, results):
    """Errors with sigmas of the first seed, NEES and spread of all."""
    cells = [run[0]]
    in_sigmas = [np.divide(*errors(found, truth)) for found, truth in results]
    found, truth = results[0]
    error, sigma = errors(found, truth)
    total = [found["camera"]["focal_px"]["sigma_total"],
             found["shutter"]["readout_s"]["sigma_total"], found["clock"]["delay_s"]["sigma_total"]]
    for name, sigma_total in zip(("f", "t_r", "t_d"), total):
        at, scale = NAMES.index(name), UNITS[name][1]
        cells.append("%+.2f ± %.2f ± %.2f" % (scale * error[at], scale * sigma[at],
                                              scale * sigma_total))
    cells.append("%.1f" % np.mean(np.square(in_sigmas)))
    cells.append("%.2f" % found["quality"]["noise_px"])
    cells.append(", ".join("`%s:%s`" % (e["name"], e["shape"]) for e in found["effects"]) or "-")
    cells.append("; ".join(found["doubts"]) or "-")
    return cells


def stabiliser_log():
    """Angles that the Pixel turned about its camera's axes, and where its lens was [units]."""
    table = lambda name: np.genfromtxt("%s/timing-pixel-ois/%s.csv" % (DATA, name), delimiter=",",
                                       skip_header=1)
    gyro, lens = table("gyro"), table("ois")
    lens = lens[np.unique(lens[:, 0], return_index=True)[1]]  # in order, once
    times = np.arange(gyro[0, 0], min(gyro[-1, 0], lens[-1, 0]), 2e6)
    at = lambda log, column: np.interp(times, log[:, 0], log[:, column])
    rates = np.stack([-at(gyro, 1), at(gyro, 2)], axis=1)  # what moves the picture in x, y
    return rates - rates.mean(0), np.stack([at(lens, 2), at(lens, 3)], axis=1)


def stabilise(rates, corner_hz, travel, circle, step_s=2e-3):
    """What a lens makes up for [rad]."""
    decay, angle, angles = np.exp(-2 * np.pi * corner_hz * step_s), np.zeros(2), [np.zeros(2)]
    for before, now in zip(rates[:-1], rates[1:]):
        angle = decay * angle + 0.5 * step_s * (decay * before + now)
        if circle:
            angle = angle * min(1.0, travel / max(1e-12, np.linalg.norm(angle)))
        else:
            angle = np.clip(angle, -travel, travel)
        angles.append(angle)
    return np.array(angles)


def stabiliser_table():
    """Which model explains the log of the lens; gains of a focal length of 4032 / 1.27 units."""
    rates, lens = stabiliser_log()
    rows = [("Model", "Corner [Hz]", "Stop [rad]", "Explained in x, y", "Gain in x, y"),
            ("---",) * 5]
    for name, corners, travels, circle in MODELS:
        best = None
        for corner in corners:
            for travel in travels:
                angle = stabilise(rates, corner, travel, circle)[250:]
                explained, gains = [], []
                for axis in range(2):
                    columns = np.column_stack([angle, np.ones(len(angle))])
                    c, *_ = np.linalg.lstsq(columns, lens[250:, axis], rcond=None)
                    left = lens[250:, axis] - columns @ c
                    explained.append(1 - left.var() / lens[250:, axis].var())
                    gains.append(abs(c[axis]) * 1.27 / 4032)
                if best is None or sum(explained) > sum(best[2]):
                    best = (corner, travel, explained, gains)
        corner, travel, explained, gains = best
        rows.append((name, "%.2g" % corner, "%.3g" % travel if np.isfinite(travel) else "-",
                     "%.1f %%, %.1f %%" % tuple(100 * e for e in explained),
                     "%.2f, %.2f" % tuple(gains)))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("camgyro", nargs="?", default=SOURCE + "/build/release/tools/camgyro",
                        help="the program (default: %(default)s)")
    camgyro = parser.parse_args().camgyro
    tasks = [(run, seed) for run in RUNS for seed in SEEDS]
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda task: measure(camgyro, *task), tasks))
    rows = [("Recording", "f - truth [px]", "t_r - truth [ms]", "t_d - truth [ms]",
             "mean squared error [sigma²]", "noise [px]", "effects", "doubts"), ("---",) * 8]
    for i, run in enumerate(RUNS):
        rows.append(row(run, results[i * len(SEEDS):(i + 1) * len(SEEDS)]))
    line = lambda cells: "| " + " | ".join(cells) + " |\n"
    with open(SOURCE + "/docs/lab/device_logs_notes.md", encoding="utf-8") as notes:
        text = notes.read()
    with open(SOURCE + "/docs/lab/device_logs.md", "w", encoding="utf-8") as out:
        out.write("# Two phones' own logs\n\nMade by `tools/measure_device_logs.py`; the text "
                  "before the tables is `docs/lab/device_logs_notes.md`.\n\n" + text)
        out.write("\n## What the Pixel's lens does\n\n")
        out.writelines(line(cells) for cells in stabiliser_table())
        out.write("\n## Calibrations\n\nErrors ± sigma ± sigma_total and the rest of seed %d; mean "
                  "squared error of all eleven parameters, seeds %s.\n\n" %
                  (SEEDS[0], ", ".join(map(str, SEEDS))))
        out.writelines(line(cells) for cells in rows)


if __name__ == "__main__":
    main()
