#!/usr/bin/python3
"""Manual pages and bash completion from what `camgyro help` prints.

    tools/help_files.py CAMGYRO DIR

writes DIR/man1/camgyro.1.gz and camgyro-COMMAND.1.gz, and DIR/completions/camgyro, which
bash-completion loads: the same bytes from the same program. Nothing is written here
that the program does not say, so that neither can be out of date.
The build runs it for `cmake --install` (cmake/CamgyroInstall.cmake).
"""
import argparse
import gzip
import os
import re
import subprocess

FLAG_COLUMN = 30  # of CommandHelp: where the descriptions start


class Flag:
    def __init__(self, name, default):
        self.name = name        # without --
        self.default = default  # as the help shows it; None: a switch
        self.text = ""


class Help:
    """`camgyro help COMMAND`, taken apart."""

    def __init__(self, text):
        usage, summary, *flags = text.strip("\n").split("\n\n")
        self.usage = usage
        self.summary = " ".join(summary.split())
        self.flags = []
        for line in "\n".join(flags).split("\n") if flags else []:
            found = re.match(r"  --([a-z0-9_]+)(?:=(\S+))?(?: +(.*))?$", line)
            if found:
                self.flags.append(Flag(found[1], found[2]))
                line = found[3] or ""
            elif line[:FLAG_COLUMN].strip():
                raise ValueError("no line of a flag: " + line)
            flag = self.flags[-1]
            flag.text = (flag.text + " " + line.strip()).strip()


def roff(text):
    """Plain text as troff reads it."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.M)


def page(title, version, name, synopsis, body, see_also):
    summary = roff(name[1])
    return "\n".join([
        '.TH %s 1 "" "%s" "User Commands"' % (title.upper(), version),
        ".nh", ".ad l",  # names of files and flags stay whole
        ".SH NAME",
        "%s \\- %s" % (roff(name[0]), summary), ".SH SYNOPSIS", ".B " + roff(synopsis), *body,
        ".SH SEE ALSO", ", ".join(".BR %s (1)" % roff(page) for page in see_also)
        .replace(", .BR", " ,\n.BR"), ""])


def command_page(command, version, text):
    body = [".SH DESCRIPTION", roff(text.summary)]
    if text.flags:
        body.append(".SH OPTIONS")
    for flag in text.flags:
        body += [".TP", "\\fB%s\\fR" % roff("--" + flag.name) +
                 ("" if flag.default is None else "=\\fI%s\\fR" % roff(flag.default)),
                 roff(flag.text)]
    short = re.split(r"[:;] ", text.summary)[0]
    return page("camgyro-" + command, version, ("camgyro-" + command, short), text.usage, body,
                ["camgyro"])


def program_page(version, text, commands):
    first, *rest = text.strip("\n").split("\n\n")
    body = [".SH DESCRIPTION"]
    for paragraph in rest:
        # Tables stay as they are printed.
        body += [".PP", ".nf", roff(paragraph), ".fi"]
    return page("camgyro", version, ("camgyro", first.split(": ", 1)[1]),
                "camgyro COMMAND [ARGUMENT...] [--flags]", body,
                ["camgyro-" + command for command in commands])


COMPLETION = '''# bash completion of camgyro; made by tools/help_files.py of its help.
_camgyro() {
  local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]} flags=
  COMPREPLY=()
  if [[ $COMP_CWORD == 1 ]]; then
    mapfile -t COMPREPLY < <(compgen -W "%(commands)s --help --version" -- "$word")
    return
  fi
  case $command in
    help)
      mapfile -t COMPREPLY < <(compgen -W "%(commands)s" -- "$word")
      return ;;
%(cases)s
  esac
  # The value of --flag=value: bash splits words at the equals sign.
  if [[ $word == "=" || ${COMP_WORDS[COMP_CWORD - 1]} == "=" ]]; then
    mapfile -t COMPREPLY < <(compgen -f -- "${word#=}")
    compopt -o filenames
  elif [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$flags --help" -- "$word")
    [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *= ]] && compopt -o nospace
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
    compopt -o filenames
  fi
}
complete -F _camgyro camgyro
'''


def completion(helps):
    cases = "\n".join(
        "    %s) flags='%s' ;;" % (command, " ".join(
            "--" + flag.name + ("" if flag.default is None else "=") for flag in text.flags))
        for command, text in helps.items() if text.flags)
    return COMPLETION % {"commands": " ".join(helps), "cases": cases}


def write(path, data):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(data)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("camgyro", metavar="CAMGYRO", help="the program")
    parser.add_argument("folder", metavar="DIR")
    options = parser.parse_args()
    camgyro, folder = options.camgyro, options.folder
    said = lambda *words: subprocess.run([camgyro, *words], check=True, capture_output=True,
                                         encoding="utf-8").stdout
    version = " ".join(said("--version").split()[:2])
    program = said("help")
    commands = re.findall(r"^  camgyro (\w+)", program, flags=re.M)
    helps = {command: Help(said("help", command)) for command in commands}
    pages = {"camgyro": program_page(version, program, commands)}
    for command, text in helps.items():
        pages["camgyro-" + command] = command_page(command, version, text)
    for name, text in pages.items():
        write("%s/man1/%s.1.gz" % (folder, name), gzip.compress(text.encode(), mtime=0))
    write(folder + "/completions/camgyro", completion(helps).encode())


if __name__ == "__main__":
    main()
