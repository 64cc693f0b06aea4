#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the words of comments, READMEs and messages by the rule of tests/README.md.

usage: check_words.py [--prune] [FOLDER]      Prints one line a finding; status 1 where there is one.

The list is short: what a simple pattern can tell. Files that were written before the rule stand in words_not_yet.txt,
and are not checked; a listed file that is clean or gone is a finding, so that the list shrinks. --prune takes such
files off the list.
"""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
NOT_YET = "tests/tree/words_not_yet.txt"
TOPS = ("slam", "ipc", "drivers", "daemon", "systemd", "config", "tools", "tests")
SUFFIXES = {".h", ".cc", ".inl", ".py", ".sh", ".md", ".yaml", ".cmake", ".lcm"}
# They quote what they refuse.
QUOTING = {"tests/README.md", "tests/tree/check_words.py", "tests/tree/check_words_test.py", NOT_YET}

OBJECT = (r"(?:it|this|that|which|camera|driver|device|kernel|system|thread|tracking|mapping|tracker|mapper|map|view|"
          r"frame|image|queue|ring|log|message|file|class|function|solver|landmark|keyframe|calibration|receiver|"
          r"coherence|measurement|reader|writer|sink|source|option|drivers|tests|images)s?")
# (pattern, what to write instead)
PHRASES = [
    (r"somebody|nobody|whoever", "name who: the caller, the thread, none"),
    (r"(?:say|says|tell|tells) nothing", "state what is missing: carries no information on, is not a prior"),
    (r"nothing any more|says so|say so", "state the fact"),
    (r"for ever", "without end, never again"),
    (r"so many|so often|so long as it", "N, and name it"),
    (r"(?:is|are|was|be|being) told(?: of| apart| to)?|told of|that is told", "receives, is distinguished, is reported"),
    (OBJECT + r" (?:does not |do not |did not |must not |need not |may |cannot |to )?"
     r"(?:know|knows|want|wants|hear|hears|likes|believe|believes|speak|speaks)", "objects hold, need, receive"),
    (r"in (?:the |its )?(?:hands|eyes) of|'s hands", "in use by, owned by"),
    (r"(?:has|have|had) (?:no|a|the|its|their) say", "weighs, has no weight"),
    (r"(?:bears?|bore|borne|bearing) (?:it |them |this )?out", "confirms"),
    (r"(?:is|are|was|were|be) as none", "counts as missing"),
    (r"(?:all|none|nothing|no one|any) but|but for", "except"),
    (r"(?:as|what|whatever|wherever) (?:it|they|he|one) likes?", "any, freely"),
    (r"new story|goes its way|in its turn gone|gone on from it", "the trade's term"),
    (r"moves nothing", "has no effect"),
]
FINDERS = [(re.compile(r"\b" + pattern + r"\b", re.IGNORECASE), advice) for pattern, advice in PHRASES]

STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"')
COMMENT_MARK = {".h": "//", ".cc": "//", ".inl": "//", ".lcm": "//", ".py": "#", ".sh": "#", ".yaml": "#", ".cmake": "#"}


def words_of(path: str, line: str) -> str:
    """What of a line people read: all of a text, comments and messages of code."""
    suffix = pathlib.PurePath(path).suffix
    if suffix == ".md":
        return line
    strings = STRING.findall(line)
    code = STRING.sub('""', line)
    mark = COMMENT_MARK[suffix]
    comment = code.split(mark, 1)[1] if mark in code else ""
    return " ".join(strings + [comment])


def findings_of(path: str, text: str):
    """One line a finding, the phrases that two lines share included."""
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        words = words_of(path, line)
        joined = (before + " " + words.strip()) if before and words else words
        for finder, advice in FINDERS:
            for match in finder.finditer(joined):
                if match.end() > len(joined) - len(words.strip()):  # not wholly of the line before
                    yield f"{path}:{number}: '{match.group(0)}': {advice}"
        before = words.strip()


def checked_files(root: pathlib.Path):
    paths = [root / "README.md"]
    for top in TOPS:
        paths += sorted((root / top).rglob("*"))
    for path in paths:
        name = path.relative_to(root).as_posix()
        if path.suffix in SUFFIXES and path.is_file() and name not in QUOTING and "node_modules" not in path.parts:
            yield name


def listed(root: pathlib.Path):
    file = root / NOT_YET
    lines = file.read_text().splitlines() if file.is_file() else []
    return {line for line in lines if line and not line.startswith("#")}


def check(root: pathlib.Path):
    not_yet, found = listed(root), []
    for name in checked_files(root):
        of_file = list(findings_of(name, (root / name).read_text()))
        if name not in not_yet:
            found += of_file
        elif not of_file:
            found.append(f"{NOT_YET}: {name} is clean: take it off the list")
    for name in sorted(not_yet):
        if not (root / name).is_file():
            found.append(f"{NOT_YET}: {name} is gone: take it off the list")
    return found


def prune(root: pathlib.Path):
    file = root / NOT_YET
    kept = []
    for line in file.read_text().splitlines():
        path = root / line
        if line.startswith("#") or path.is_file() and any(findings_of(line, path.read_text())):
            kept.append(line)
    file.write_text("\n".join(kept) + "\n")


def main():
    arguments = sys.argv[1:]
    pruning = "--prune" in arguments
    folders = [argument for argument in arguments if argument != "--prune"]
    root = pathlib.Path(folders[0]) if folders else HERE.parents[1]
    if pruning:
        prune(root)
    findings = check(root)
    for finding in findings:
        print(finding)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
