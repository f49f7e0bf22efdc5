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


def modules_of(path):
    """What a script imports, also by way of the others beside it."""
    with open(path, encoding="utf-8") as file:
        found = set(re.findall(r"^(?:import|from) (\w+)", file.read(), re.M))
    for name in sorted(found):
        beside = os.path.join(TOOLS, name + ".py")
        if os.path.exists(beside):
            found |= modules_of(beside)
    return found


class ScriptsTest(unittest.TestCase):
    def test_all_have_help(self):
        for path in sorted(glob.glob(TOOLS + "/*.py")):
            with open(path, encoding="utf-8") as file:
                source = file.read()
            if '__name__ == "__main__"' not in source:
                continue  # a module of the others
            missing = sorted(name for name in modules_of(path).intersection(OPTIONAL)
                             if importlib.util.find_spec(name) is None)
            with self.subTest(os.path.basename(path)):
                if missing:
                    self.skipTest("no " + ", ".join(missing))
                asked = subprocess.run([sys.executable, path, "--help"], capture_output=True,
                                       encoding="utf-8", timeout=60, check=False)
                self.assertEqual(asked.returncode, 0, asked.stderr)
                self.assertTrue(asked.stdout.startswith("usage: "), asked.stdout)


if __name__ == "__main__":
    unittest.main()
