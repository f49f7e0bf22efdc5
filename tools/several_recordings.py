#!/usr/bin/python3
"""Calibrates several recordings of one device together and prints, by parameter, the spread between
the recordings beside their noise:

    tools/several_recordings.py [--camgyro PATH] [--parts N] [--flags "..."] RECORDING...

With --parts, each recording is cut into N stretches of equal length, which are the recordings: what
the camera's files say of one stretch with all of the gyro's.
"""
import argparse
import os
import subprocess
import tempfile

import yaml

from recording_copy import copy_recording, frame_stamps

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def cut(recording, parts, folder):
    """Folders of the stretches of a recording in the EuRoC layout, below `folder`."""
    stamps = frame_stamps(recording)
    first, span = stamps[0], stamps[-1] + 1 - stamps[0]
    made = []
    for part in range(parts):
        begin, end = (first + span * p // parts for p in (part, part + 1))
        made.append(copy_recording(
            recording, "%s/%s_%d" % (folder, os.path.basename(recording.rstrip("/")), part + 1),
            keep=lambda ns, begin=begin, end=end: begin <= ns < end))
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+")
    parser.add_argument("--parts", type=int, default=1)
    parser.add_argument("--flags", default="")
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        recordings = options.recordings
        if options.parts > 1:
            recordings = [part for r in recordings for part in cut(r, options.parts, folder)]
        done = subprocess.run([options.camgyro, "calibrate", *recordings, "--out", folder + "/out",
                               *options.flags.split()], capture_output=True, text=True, check=False)
        if not os.path.exists(folder + "/out/calibration.yaml"):
            raise SystemExit(done.stderr)
        with open(folder + "/out/calibration.yaml", encoding="utf-8") as file:
            device = yaml.safe_load(file)
    print(" ".join(line for line in done.stdout.splitlines() if line.startswith("refused")))
    agreement = device["recordings"]["agreement"]
    print("%d recordings; shared parameters disagree with chi2 %.0f on %d degrees of freedom, "
          "p = %.1g" % (len(device["recordings"]["names"]), agreement["chi2"], agreement["dof"],
                        agreement["p_value"]))
    print("| parameter | of | noise of one (median) | between recordings | chi2 per dof | p |")
    print("| --- | --- | --- | --- | --- | --- |")
    for p in device["recordings"]["parameters"]:
        if p["recordings"] < 2 or "sigmas" not in p:
            continue
        print("| %s%s | %d | %.3g | %.3g | %.1f | %.1g |" % (
            p["name"], "" if p["shared"] else " (not shared)", p["recordings"],
            sorted(p["sigmas"])[len(p["sigmas"]) // 2], p["between"],
            p["chi2"] / (p["recordings"] - 1), p["p_value"]))
    for odd in device["recordings"]["odd"]:
        print("odd: %s, its %s is %.1f sigmas off the others (p = %.1g)" % (
            odd["recording"], odd["parameter"], abs(odd["sigmas"]), odd["p_value"]))


if __name__ == "__main__":
    main()
