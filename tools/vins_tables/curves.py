#!/usr/bin/env python3
"""curves.py CURVES.csv: how sharp the minimum of Feng's search is.

Reads what `vins_tables --what=delay --curves=CURVES.csv` wrote; prints, for each recording and
reference, the residual (root mean square angle, median over the windows) at delays off the
window's own minimum, in mrad.
"""
import collections
import csv
import statistics
import sys

OFFSETS_MS = (0, 2, 5, 10, 20, 50, 100, 200)


def main():
  if len(sys.argv) != 2:
    sys.exit(__doc__)
  windows = collections.defaultdict(list)
  with open(sys.argv[1], newline='') as file:
    for name, reference, window, delay, square in list(csv.reader(file))[1:]:
      windows[name, reference, window].append((float(delay), float(square)))
  rows = collections.defaultdict(lambda: collections.defaultdict(list))
  for (name, reference, _), curve in windows.items():
    least_at = min(curve, key=lambda point: point[1])[0]
    for offset in OFFSETS_MS:
      for sign in (-1, 1):
        at = least_at + sign * 1e-3 * offset
        delay, square = min(curve, key=lambda point: abs(point[0] - at))
        if abs(delay - at) < 1e-3:
          rows[name, reference][offset].append(1e3 * square**0.5)
  print('| recording | reference | ' + ' | '.join(f'{o} ms' for o in OFFSETS_MS) + ' |')
  print('| --- ' * (2 + len(OFFSETS_MS)) + '|')
  for (name, reference), offsets in rows.items():
    cells = (f'{statistics.median(offsets[o]):.2f}' if offsets[o] else '' for o in OFFSETS_MS)
    print(f'| {name} | {reference} | ' + ' | '.join(cells) + ' |')


if __name__ == '__main__':
  main()
