#!/usr/bin/python3
"""What commands take of memory with long recordings of tracks: simulates walks, runs the commands
on them and prints the largest resident size and the processor's time of each as a table.

    tools/memory.py [--camgyro PATH] [--minutes 10,60] [--tracks 60,150] [--commands LIST]
                    [--keep DIR]

commands: simulate, delay, calibrate, diagnose, odometry, rectify, export; without: the first three
and odometry, rectify, export. --keep: the recordings are made there, and used again.
"""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def run(command):
    """Largest resident size [MB], processor time [s], and exit code."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    words = child.stderr.read().decode()
    _, status, usage = os.wait4(child.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    if code not in (0, 4):
        raise SystemExit("%s: exit code %d\n%s" % (" ".join(command), code, words))
    return (usage.ru_maxrss / 1024.0, usage.ru_utime + usage.ru_stime, code)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--camgyro", default=SOURCE + "/build/release/tools/camgyro")
    parser.add_argument("--minutes", default="10")
    parser.add_argument("--tracks", default="60")
    parser.add_argument("--commands", default="simulate,delay,calibrate,odometry,rectify,export")
    parser.add_argument("--keep")
    options = parser.parse_args()
    folder = options.keep or tempfile.mkdtemp(prefix="camgyro_memory_")
    print("| minutes | tracks | command | largest resident size [MB] | processor [s] |")
    print("| --- | --- | --- | --- | --- |")
    for minutes in options.minutes.split(","):
        for tracks in options.tracks.split(","):
            recording = "%s/walk_%s_%s" % (folder, minutes, tracks)
            results = recording + ".results"
            calibration = "--calibration=%s/calibration.yaml" % results
            commands = {
                "simulate": ["simulate", SOURCE + "/tools/scenarios/motion_walking.yaml",
                             "duration_s=%g" % (60.0 * float(minutes)), "tracks.count=" + tracks,
                             "--out=" + recording],
                "delay": ["delay", recording, "--quiet"],
                "calibrate": ["calibrate", recording, "--out=" + results, "--quiet"],
                "diagnose": ["diagnose", recording, "--out=%s.diagnosis" % recording, "--quiet"],
                "odometry": ["odometry", recording, calibration, "--out=%s.odometry" % recording,
                             "--quiet"],
                "rectify": ["rectify", recording, calibration, "--out=%s.rectified" % recording,
                            "--quiet"],
                "export": ["export", results + "/calibration.yaml", "--format=kalibr",
                           "--out=%s.exported" % recording],
            }
            for name in options.commands.split(","):
                if name == "simulate" and os.path.exists(recording + "/truth_trajectory.tum"):
                    continue
                if name == "rectify":
                    shutil.rmtree(recording + ".rectified", ignore_errors=True)
                peak, processor, code = run([options.camgyro] + commands[name])
                print("| %s | %s | %s%s | %.0f | %.0f |" % (
                    minutes, tracks, name, "" if code == 0 else " (exit code 4)", peak, processor),
                      flush=True)
    if not options.keep:
        shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
