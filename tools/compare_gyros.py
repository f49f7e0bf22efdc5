#!/usr/bin/python3
"""Delays between gyros on one rigid body, by their readings and by camgyro.

    tools/compare_gyros.py [path of camgyro]

Prints the tables of "one camera, five gyros" in docs/lab/measured_notes.md; the recordings lie in
$CAMGYRO_DATA/tango-walk (default: ../shared/data beside the source). Of every two gyros, the delay
by which
    w_first(t) = M w_second(t + delay) + bias
fits best, M any 3 x 3 matrix: no camera and nothing of camgyro takes part. Their calibrated t_d
should differ by as much. Stamps are a straight line over the number of the sample; beside it, as
they are recorded.
"""
import argparse
import csv
import os
import tempfile

import numpy as np

from calibration_errors import NAMES as PARAMETERS
from measure import DATA, SOURCE, run

DELAY = PARAMETERS.index("t_d")
NAMES = ["imu%d" % i for i in range(1, 6)]
STRETCH_S = 4.0
GRID_S = 1e-3  # rates are smooth at the time of a sample (10 ms), so that a line joins these


def read(recording):
    with open(os.path.join(recording, "imu0/data.csv")) as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    stamps = np.array([int(row[0]) for row in rows])
    return stamps, np.array([[float(x) for x in row[1:4]] for row in rows])


def on_a_line(t):
    """Least squares without the samples that are far off it."""
    usual = np.polyfit(np.arange(200), t[:200], 1)[0]
    number = np.concatenate([[0], np.cumsum(np.maximum(1, np.round(np.diff(t) / usual)))])
    kept = np.ones(len(t), bool)
    for _ in range(10):
        line = np.polyval(np.polyfit(number[kept], t[kept], 1), number)
        off = np.abs(t - line)
        kept = off <= 3 * 1.4826 * np.median(off)
    return line


def smooth(t, w, grid):
    """Cubic through the readings (Catmull-Rom), on the grid."""
    slope = np.gradient(w, t, axis=0)
    i = np.clip(np.searchsorted(t, grid) - 1, 0, len(t) - 2)
    h = (t[i + 1] - t[i])[:, None]
    s = ((grid - t[i]) / h[:, 0])[:, None]
    return ((1 + 2 * s) * (1 - s)**2 * w[i] + s * (1 - s)**2 * h * slope[i] +
            s * s * (3 - 2 * s) * w[i + 1] + s * s * (s - 1) * h * slope[i + 1])


def delay_s(first, second, begin, end):
    """Delay, its noise and the rms of what is left [rad/s]."""
    t, w = first
    use = (t > begin) & (t < end)
    delay, sigma, rms = 0.0, float("nan"), float("nan")
    for _ in range(10):
        at = t[use] + delay
        x = smooth(*second, at)
        slope = (smooth(*second, at + GRID_S) - smooth(*second, at - GRID_S)) / (2 * GRID_S)
        basis = np.column_stack([x, np.ones(len(x))])
        fit = np.linalg.lstsq(basis, w[use], rcond=None)[0]
        left = w[use] - basis @ fit
        moves = slope @ fit[:3]
        moves -= basis @ np.linalg.lstsq(basis, moves, rcond=None)[0]
        delay += (moves * left).sum() / (moves * moves).sum()
        rms = np.sqrt((left * left).mean())
        sigma = rms / np.sqrt((moves * moves).sum())
    return delay, sigma, rms


def print_pairs(gyros):
    """Of every two; the delays of all after the first, by least squares."""
    begin = max(t[0] for t, _ in gyros) + 0.5
    end = min(t[-1] for t, _ in gyros) - 0.5
    edges = np.linspace(begin, end, int((end - begin) / STRETCH_S) + 1)
    print("| First | Second | Delay [ms] | Scatter of stretches [ms] | Drift [ppm] | Left [rad/s] |")
    print("|" + " --- |" * 6)
    rows, delays = [], []
    for i, first in enumerate(gyros):
        for j in range(i + 1, len(gyros)):
            whole, sigma, rms = delay_s(first, gyros[j], begin, end)
            parts = [delay_s(first, gyros[j], a, b)[0] for a, b in zip(edges[:-1], edges[1:])]
            drift = np.polyfit(0.5 * (edges[:-1] + edges[1:]), parts, 1)[0]
            print("| %s | %s | %.3f ± %.3f | %.2f | %.0f | %.4f |" % (
                NAMES[i], NAMES[j], 1e3 * whole, 1e3 * sigma, 1e3 * np.std(parts, ddof=1),
                1e6 * drift, rms))
            row = np.zeros(len(gyros))
            row[i], row[j] = -1, 1
            rows.append(row)
            delays.append(whole)
    rows.append(np.ones(len(gyros)))  # the mean of all is nobody's to say
    return np.linalg.lstsq(np.array(rows), np.array(delays + [0.0]), rcond=None)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("camgyro", nargs="?", help="the program (default: %(default)s)",
                        default=os.path.join(SOURCE, "build/release/tools/camgyro"))
    camgyro = os.path.abspath(parser.parse_args().camgyro)
    folders = [os.path.join(DATA, "tango-walk", name) for name in NAMES]
    read_all = [read(folder) for folder in folders]
    origin = read_all[0][0][0]
    recorded = [((stamps - origin) / 1e9, w) for stamps, w in read_all]
    print("As recorded:\n")
    print_pairs(recorded)
    print("\nLaid on a line:\n")
    own_ms = 1e3 * print_pairs([(on_a_line(t), w) for t, w in recorded])
    with tempfile.TemporaryDirectory() as temporary:
        fits = [run(camgyro, folder, "", os.path.join(temporary, name))
                for name, folder in zip(NAMES, folders)]
    td, sigma = (1e3 * np.array([fit[key][DELAY] for fit in fits]) for key in ("values", "sigma"))
    less = td - own_ms
    print("\n| Gyro | t_d [ms] | Its clock by the gyros alone [ms] | t_d less that [ms] |")
    print("|" + " --- |" * 4)
    for row in zip(NAMES, td, sigma, own_ms, less):
        print("| %s | %.2f ± %.2f | %+.2f | %.2f |" % row)
    print("\nStandard deviation of t_d: %.2f ms; less the clocks: %.2f ms" % (
        td.std(ddof=1), less.std(ddof=1)))


if __name__ == "__main__":
    main()
