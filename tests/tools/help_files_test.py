#!/usr/bin/python3
"""Manual pages and bash completion say what `camgyro help` says: help_files_test.py CAMGYRO."""
import gzip
import os
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CAMGYRO = sys.argv.pop(1)


def said(*words):
    return subprocess.run(words, check=True, capture_output=True, encoding="utf-8").stdout


def plain(roff):
    """Words of a page, without what only troff needs."""
    return " ".join(re.sub(r"\\f[BRI]|\\&", "", roff).replace("\\-", "-").replace("\\e", "\\")
                    .split())


class HelpFilesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.room = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.room.cleanup)
        cls.folder = cls.room.name
        said(SOURCE + "/tools/help_files.py", CAMGYRO, cls.folder)
        cls.commands = re.findall(r"^  camgyro (\w+)", said(CAMGYRO, "help"), flags=re.M)

    def page(self, name):
        with gzip.open("%s/man1/%s.1.gz" % (self.folder, name), "rt", encoding="utf-8") as file:
            return file.read()

    def complete(self, *words):
        """What is offered in place of the last word."""
        script = ("source %s/completions/camgyro; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); "
                  "compopt() { :; }; _camgyro; printf '%%s\\n' \"${COMPREPLY[@]}\"" % self.folder)
        return said("bash", "-c", script, "bash", *words).split()

    def test_every_flag_has_its_words(self):
        self.assertIn("calibrate", self.commands)
        for command in self.commands:
            # Usage, summary and flags, without the layout.
            for part in re.split(r"\n\n|\n  (?=--)|  +", said(CAMGYRO, "help", command)):
                for line in part.split("\n"):
                    self.assertIn(" ".join(line.split()), plain(self.page("camgyro-" + command)))

    def test_the_program_has_a_page_that_names_all_commands(self):
        page = plain(self.page("camgyro"))
        for line in said(CAMGYRO, "help").split("\n")[2:]:
            self.assertIn(" ".join(line.split()), page)
        for command in self.commands:
            self.assertIn("camgyro-%s (1)" % command, page)

    def test_troff_has_no_complaints(self):
        try:
            said("groff", "--version")
        except FileNotFoundError:
            self.skipTest("no groff")
        for name in ["camgyro"] + ["camgyro-" + command for command in self.commands]:
            done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z"], input=self.page(name),
                                  capture_output=True, encoding="utf-8", check=True)
            self.assertEqual(done.stderr, "", name)

    def test_completes_commands_flags_and_files(self):
        self.assertEqual(self.complete("camgyro", "cal"), ["calibrate"])
        self.assertEqual(set(self.complete("camgyro", "help", "")), set(self.commands))
        self.assertEqual(self.complete("camgyro", "calibrate", "--nor"), ["--norobust",
                                                                          "--norefine"])
        self.assertEqual(self.complete("camgyro", "calibrate", "x", "--outp"), [])
        self.assertEqual(self.complete("camgyro", "export", "--for"), ["--format="])
        for start in [("export", ), ("export", "--out", "=")]:
            found = self.complete("camgyro", *start, self.folder + "/man")
            self.assertEqual(found, [self.folder + "/man1"])
        self.assertIn(self.folder + "/man1",
                      self.complete("camgyro", "calibrate", self.folder + "/"))

    def test_the_same_program_gives_the_same_bytes(self):
        before = self.page("camgyro-calibrate")
        said(SOURCE + "/tools/help_files.py", CAMGYRO, self.folder)
        self.assertEqual(self.page("camgyro-calibrate"), before)
        with open(self.folder + "/man1/camgyro.1.gz", "rb") as file:
            self.assertEqual(file.read()[4:8], bytes(4))  # no time of day inside


if __name__ == "__main__":
    unittest.main()
