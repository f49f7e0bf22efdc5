#!/usr/bin/python3
"""The Python scripts of tools/ say what they do when they are asked with --help, and do nothing."""
import glob
import importlib.util
import os
import re
import subprocess
import sys
import unittest

TOOLS = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))),
                     "tools")
OPTIONAL = ("matplotlib", "numpy", "scipy", "yaml")  # not on every machine that runs the tests


class ScriptsTest(unittest.TestCase):
    def test_all_have_help(self):
        for path in sorted(glob.glob(TOOLS + "/*.py")):
            with open(path, encoding="utf-8") as file:
                source = file.read()
            if '__name__ == "__main__"' not in source:
                continue  # a module of the others
            missing = [name for name in OPTIONAL if importlib.util.find_spec(name) is None
                       and re.search(r"^(import|from) %s\b" % name, source, re.M)]
            with self.subTest(os.path.basename(path)):
                if missing:
                    self.skipTest("no " + ", ".join(missing))
                asked = subprocess.run([sys.executable, path, "--help"], capture_output=True,
                                       encoding="utf-8", timeout=60, check=False)
                self.assertEqual(asked.returncode, 0, asked.stderr)
                self.assertTrue(asked.stdout.startswith("usage: "), asked.stdout)


if __name__ == "__main__":
    unittest.main()
