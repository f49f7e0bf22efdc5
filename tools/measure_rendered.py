#!/usr/bin/python3
"""Renders video scenarios, calibrates them from their pictures, and writes docs/lab/rendered.md.

    tools/measure_rendered.py [path of camgyro] [--seeds A-B KEY=VALUE ...]

20 s of 640 x 480 each, tracked with the project's own KLT, beside the truth of the simulator. With
--seeds: of video_room only, changed by KEY=VALUE as in `camgyro simulate`; the page is printed
instead of written.
"""
import argparse
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import yaml

from calibration_errors import NAMES, errors

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# Scenario and what differs from its file.
RUNS = ([("video_room", ["seed=%d" % seed]) for seed in (1, 2)] +
        [("video_room", ["seed=%d" % seed, "camera.readout_s=-0.016", "camera.delay_s=0.031"])
         for seed in (3,)] +
        [("video_street", ["seed=%d" % seed, "effects.radial_distortion={}"])
         for seed in (1, 2)])
# What is asked for; a line of the table.
LIMITS = ("limit", "0.3", "0.5", "0.5", "0.15", "", "")


def measure(camgyro, scenario, changes):
    """A row of the table, and the errors in sigmas (11)."""
    with tempfile.TemporaryDirectory() as folder:
        recording, out = folder + "/recording", folder + "/out"
        scenario_file = os.path.join(SOURCE, "tools/scenarios", scenario + ".yaml")
        subprocess.run([camgyro, "simulate", scenario_file, *changes, "--out", recording],
                       check=True, stdout=subprocess.DEVNULL)
        subprocess.run([camgyro, "calibrate", recording, "--out", out, "--quiet"], check=True,
                       stdout=subprocess.DEVNULL)
        load = lambda name: yaml.safe_load(open(name, encoding="utf-8"))
        found, truth = load(out + "/calibration.yaml"), load(recording + "/truth.yaml")
    error, sigma = errors(found, truth)

    def gap(name, scale):
        at = NAMES.index(name)
        return "%.3f ± %.3f" % (scale * error[at], scale * sigma[at])

    row = ("%s %s" % (scenario, " ".join(changes)), gap("t_d", 1e3), gap("t_r", 1e3),
           gap("f", 100.0 / truth["camera"]["focal_px"]["value"]),
           "%.3f (sigma %.3f)" % (np.degrees(np.linalg.norm(error[8:])),
                                  np.degrees(np.linalg.norm(sigma[8:]))),
           "%.3f" % found["quality"]["noise_px"], "%.2f" % np.mean((error / sigma)**2))
    print(*row, sep=" | ", flush=True)
    return row, error / sigma


def write_page(out, measured):
    """measured: what `measure` returns of each recording."""
    rows = [("Recording", "t_d - truth [ms]", "t_r - truth [ms]", "f - truth [%]",
             "angle of q_c [deg]", "noise [px]", "mean squared error [sigma²]"), ("---",) * 7,
            *(row for row, _ in measured), LIMITS]
    in_sigmas = np.array([e for _, e in measured])
    out.write("# Calibration from rendered video\n\nMade by `tools/measure_rendered.py`: "
              "scenarios of `tools/scenarios`, 20 s of 640 x 480 at 30 frames/s, rendered row "
              "by row with motion blur, photon noise and vignetting, encoded as H.264, tracked "
              "with the project's own KLT, calibrated without any guess.\n\n")
    out.writelines("| " + " | ".join(row) + " |\n" for row in rows)
    out.write("\nSquared errors in sigmas of all eleven parameters have a mean of %.2f over "
              "the %d recordings (honest sigmas: 1); %d of %d are within 3 sigmas. By "
              "parameter, mean error in sigmas and its root mean square:\n\n" % (
                  np.mean(in_sigmas**2), len(measured), np.sum(abs(in_sigmas) < 3),
                  in_sigmas.size))
    out.write("| | " + " | ".join(NAMES) + " |\n|" + " --- |" * 12 + "\n")
    out.write("| mean | " + " | ".join("%+.1f" % v for v in np.mean(in_sigmas, 0)) + " |\n")
    out.write("| rms | " + " | ".join(
        "%.1f" % v for v in np.sqrt(np.mean(in_sigmas**2, 0))) + " |\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("camgyro", nargs="?", default=SOURCE + "/build/release/tools/camgyro",
                        help="the program (default: %(default)s)")
    parser.add_argument("--seeds", help="from A to B")
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE")
    options = parser.parse_intermixed_args()
    if options.changes and not options.seeds:
        parser.error("KEY=VALUE needs --seeds A-B: the page is of the scenarios as they are")
    runs = RUNS
    if options.seeds:
        first, last = (int(seed) for seed in options.seeds.split("-"))
        runs = [("video_room", ["seed=%d" % seed, *options.changes])
                for seed in range(first, last + 1)]
    with ThreadPoolExecutor(2) as pool:
        measured = list(pool.map(lambda run: measure(options.camgyro, *run), runs))
    if options.seeds:
        write_page(sys.stdout, measured)
        return
    with open(SOURCE + "/docs/lab/rendered.md", "w", encoding="utf-8") as out:
        write_page(out, measured)


if __name__ == "__main__":
    main()
