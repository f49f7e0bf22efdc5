#!/usr/bin/python3
"""Checks that links in Markdown files and paths docs/... in any file lead somewhere.

    tests/docs/links_test.py [source folder]        prints what does not; exit code 1 if there is any
"""
import os
import re
import sys

SOURCE = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(__file__) + "/../..")
LINK = re.compile(r"\]\(([^()\s]+)\)")
CITED = re.compile(r"\bdocs/[\w/.-]*\.(?:md|svg|png|jsonl)\b")
TEXT = (".md", ".h", ".cc", ".in", ".py", ".sh", ".txt", ".yaml", ".cmake")


def files():
    for folder, folders, names in os.walk(SOURCE):
        folders[:] = [f for f in folders if f not in ("build", "out") and not f.startswith(".")]
        yield from (os.path.join(folder, name) for name in names if name.endswith(TEXT))


def anchors(text):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ +(.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def main():
    faults, checked = [], 0
    for file in files():
        with open(file, encoding="utf-8") as page:
            text = page.read()
        for number, line in enumerate(text.split("\n"), 1):
            where = "%s:%d: " % (os.path.relpath(file, SOURCE), number)
            for cited in CITED.findall(line):
                checked += 1
                if not os.path.exists(os.path.join(SOURCE, cited)):
                    faults.append(where + cited + " is not there")
            for link in LINK.findall(line) if file.endswith(".md") else ():
                if re.match(r"[a-z]+:", link):
                    continue
                checked += 1
                path, _, anchor = link.partition("#")
                target = os.path.normpath(os.path.join(os.path.dirname(file), path)) if path else file
                if not os.path.exists(target):
                    faults.append(where + link + " is not there")
                elif anchor:
                    with open(target, encoding="utf-8") as page:
                        if anchor not in anchors(page.read()):
                            faults.append(where + "no heading #" + anchor)
    print("\n".join(faults) or "%d links lead somewhere" % checked)
    return 1 if faults or checked < 50 else 0


if __name__ == "__main__":
    sys.exit(main())
