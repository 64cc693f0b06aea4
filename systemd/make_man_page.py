#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: make_man_page.py PROGRAM SECTION VERSION MORE OUTPUT

Writes PROGRAM's manual page as packed roff. Description, options and sub-commands come from --help of the program and of
each sub-command; sections that --help does not have (files, signals) are appended from the text file MORE.
"""

import gzip
import pathlib
import re
import subprocess
import sys


class HelpError(RuntimeError):
    pass


def help_of(program, *words):
    done = subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=False)
    if done.returncode != 0 or "Usage:" not in done.stdout:
        raise HelpError(f"{' '.join([str(program), *words])} --help: status {done.returncode}, expected a text with 'Usage:'")
    return done.stdout


class Help:
    """One --help text, by its parts."""

    def __init__(self, text):
        before, _, after = text.partition("Usage: ")
        usage, _, rest = (after + "\n").partition("\n")
        self.description = before.strip()
        self.usage = usage.strip()
        self.lists = {}
        # Lists come first, each after an empty line; the footer is what follows them.
        while match := re.match(r"\n(Positionals|Options|Subcommands):\n((?:  .*\n)+)", rest):
            self.lists[match.group(1)] = list(entries(match.group(2)))
            rest = rest[match.end():]
        self.footer = rest.strip("\n")

    def names(self, of_list):
        return [name.split()[0] for name, _ in self.lists.get(of_list, [])]


def entries(block):
    """(name, explanation) of each entry. CLI11 begins an entry after two spaces, and indents the rest further."""
    name, words = None, []
    for line in block.splitlines():
        if line.startswith("   "):
            words.append(line.strip())
            continue
        if name is not None:
            yield name, " ".join(words)
        name, _, first = re.match(r"  (.*?)(\s{2,}(.*))?$", line).groups()
        words = [first.strip()] if first else []
    if name is not None:
        yield name, " ".join(words)


def roff(text):
    """Text as roff shows it: no escapes, no requests at the start of a line, hyphens that can be searched."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga")
    text = text.replace("^", "\\(ha").replace("~", "\\(ti")
    return "\n".join("\\&" + line if line.startswith(".") else line for line in text.splitlines())


def option_name(name):
    """'-o,--output TEXT REQUIRED' as people write it."""
    name = re.sub(r"^(-\w),(--)", r"\1, \2", name)
    name = re.sub(r" (Excludes|Needs): .*$", "", name)
    return name.replace(" REQUIRED", " (required)")


def as_list(pairs):
    for name, explanation in pairs:
        yield ".TP\n\\fB" + roff(option_name(name)) + "\\fR\n" + (roff(explanation) or "\\&")


def paragraphs(text):
    """Prose flows; lines that begin with spaces, and what they stand among, stay as they are."""
    for block in re.split(r"\n{2,}|\n(?=Examples?\b)", text):
        if not block.strip():
            continue
        if re.search(r"^\s", block, re.MULTILINE):
            yield ".PP\n.nf\n" + roff(block) + "\n.fi"
        else:
            yield ".PP\n" + roff(block)


def command_section(program, words, depth=0):
    part = Help(help_of(program, *words))
    yield (".SS " if depth == 0 else ".PP\n\\fB") + roff(" ".join(words)) + ("" if depth == 0 else "\\fR")
    yield ".PP\n" + roff(part.description)
    yield ".PP\n\\fB" + roff(part.usage) + "\\fR"
    for title in ("Positionals", "Options"):
        yield from as_list(pair for pair in part.lists.get(title, []) if not pair[0].startswith("-h,"))
    yield from paragraphs(part.footer)
    for name in part.names("Subcommands"):
        yield from command_section(program, [*words, name], depth + 1)


def page(program, section, version, more):
    name = program.name
    whole = Help(help_of(program))
    title, _, description = whole.description.partition("\n")
    summary = title.partition(": ")[2].rstrip(".")
    yield f'.TH {name.upper()} {section} "" "Farpoint {version}" "Farpoint"'
    yield f".SH NAME\n{name} \\- {roff(summary)}"
    yield f".SH SYNOPSIS\n\\fB{roff(whole.usage)}\\fR"
    yield ".SH DESCRIPTION"
    yield from paragraphs(description)
    yield ".SH OPTIONS"
    yield from as_list(whole.lists.get("Options", []))
    if whole.lists.get("Subcommands"):
        yield ".SH COMMANDS"
        for command in whole.names("Subcommands"):
            yield from command_section(program, [command])
    yield ".SH EXAMPLES AND EXIT STATUS"
    yield from paragraphs(whole.footer)
    for part in re.split(r"^(?=[A-Z][A-Z ]+$)", more, flags=re.MULTILINE):
        heading, _, body = part.strip().partition("\n")
        if heading:
            yield f".SH {heading}"
            yield from paragraphs(body)


def main():
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    program, section, version, more, output = sys.argv[1:]
    try:
        text = "\n".join(page(pathlib.Path(program), section, version, pathlib.Path(more).read_text())) + "\n"
    except (HelpError, OSError) as error:
        sys.exit(f"make_man_page.py: {error}")
    pathlib.Path(output).write_bytes(gzip.compress(text.encode(), 9, mtime=0))


if __name__ == "__main__":
    main()
