#!/usr/bin/python3
"""The workflow of tools/fleet on one machine, with workers killed in the middle, makes the files of
one `camgyro batch`: fleet_test.py CAMGYRO. tools/fleet/slurm_test.sh is the same on Slurm."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CAMGYRO = os.path.abspath(sys.argv.pop(1))
SKIPPED = 77  # tests/CMakeLists.txt

SCENARIO = """
duration_s: 3
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 40, noise_px: 0.2}
"""

# camgyro, but the first run for device one loses its worker, and that for device two is killed.
KILLS = """#!/bin/bash
camgyro=%s
case "$*" in
  *--only=one*) victim=worker ;;
  *--only=two*) victim=batch ;;
  *) exec "$camgyro" "$@" ;;
esac
mkdir "%s/killed-$victim" 2>/dev/null || exec "$camgyro" "$@"
"$camgyro" "$@" &
batch=$!
until worker=$(pgrep -P $batch); do sleep 0.01; done
sleep 0.1
if [[ $victim == worker ]]; then kill -9 "$worker"; else kill -9 $batch; fi
wait $batch
"""


def files_of(folder):
    """Contents by name, without what a run says of itself."""
    found = {}
    for place, _, names in os.walk(folder):
        for name in names:
            if name in ("log.txt", "batch.log", "outcome.yaml") or name.endswith(".html"):
                continue  # times, and places
            path = os.path.join(place, name)
            with open(path, encoding="utf-8") as file:
                found[os.path.relpath(path, folder)] = file.read()
    return found


class FleetTest(unittest.TestCase):
    def setUp(self):
        room = tempfile.TemporaryDirectory()
        self.addCleanup(room.cleanup)
        self.folder = room.name
        with open(self.path("scenario.yaml"), "w", encoding="utf-8") as file:
            file.write(SCENARIO)
        for seed, name in enumerate(("a", "b", "c"), start=1):
            subprocess.run([CAMGYRO, "simulate", self.path("scenario.yaml"), "seed=%d" % seed,
                            "--out", self.path(name)], check=True, stdout=subprocess.DEVNULL)
        # Of device two, a recording is not there: an answer, which nobody asks for again.
        self.manifest = self.path("list.csv")
        with open(self.manifest, "w", encoding="utf-8") as file:
            file.write("device,recording\none,a\ntwo,b\none,c\ntwo,missing\n")
        self.camgyro = self.path("camgyro.sh")
        with open(self.camgyro, "w", encoding="utf-8") as file:
            file.write(KILLS % (CAMGYRO, self.folder))
        os.chmod(self.camgyro, 0o755)

    def path(self, name):
        return os.path.join(self.folder, name)

    def snakemake(self, *words):
        environment = dict(os.environ, HOME=self.folder)  # its caches
        return subprocess.run(
            ["snakemake", "-s", SOURCE + "/tools/fleet/Snakefile", "--cores", "2",
             "--restart-times", "3", "-d", self.folder, *words, "--config",
             "manifest=" + self.manifest, "out=" + self.path("out"), "camgyro=" + self.camgyro],
            env=environment, capture_output=True, encoding="utf-8", check=False)

    def test_killed_workers_change_nothing(self):
        plain = subprocess.run([CAMGYRO, "batch", self.manifest, "--out=" + self.path("plain")],
                               check=False, capture_output=True, encoding="utf-8")
        self.assertIn("1 of 4 recordings failed", plain.stderr)
        done = self.snakemake()
        self.assertEqual(done.returncode, 0, done.stderr)
        for victim in ("worker", "batch"):
            self.assertTrue(os.path.exists(self.path("killed-" + victim)), victim)
        self.assertIn("a worker crashed", done.stderr)
        self.assertIn("camgyro ended with 137", done.stderr)
        out, expected = files_of(self.path("out")), files_of(self.path("plain"))
        for device in ("one", "two"):
            del out[device + "/recordings.csv"]
        self.assertEqual(sorted(out), sorted(expected))
        for name, text in expected.items():
            self.assertEqual(out[name], text, name)
        # Nothing is left to do; a recording more is of one device.
        self.assertIn("Nothing to be done", self.snakemake().stderr)
        with open(self.manifest, "a", encoding="utf-8") as file:
            file.write("two,other\n")
        again = self.snakemake("--dry-run")
        self.assertIn("two/recordings.csv", again.stdout + again.stderr)
        self.assertNotIn("output: %s/one" % self.path("out"), again.stdout + again.stderr)


if __name__ == "__main__":
    if shutil.which("snakemake") is None:
        print("SKIPPED: there is no snakemake (tools/install_deps.sh snakemake)")
        sys.exit(SKIPPED)
    unittest.main()
