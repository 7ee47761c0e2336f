#!/usr/bin/env bash
# The pages as a site for a browser, by Debian's mkdocs, from the same Markdown:
#   docs/make_site.sh OUT [BUILD]
# BUILD (build, unless given) has the pages that are made, in its docs/: parameters, columns, findings, plausible values.
# Its menu is the tables of docs/README.md. The theme (mkdocs' own, as Debian has it) brings its fonts and scripts along; nothing is
# loaded from the network. Links that lead nowhere are errors. Exit code 77: mkdocs is not installed.
set -euo pipefail
[ $# -eq 1 ] || [ $# -eq 2 ] || { echo "usage: docs/make_site.sh OUT [BUILD]" >&2; exit 2; }
command -v mkdocs >/dev/null || { echo "mkdocs is not installed: apt-get install mkdocs" >&2; exit 77; }
mkdir -p "$1"
out=$(realpath "$1") project=$(realpath "$(dirname "$0")/..")
build=$(realpath -m "${2:-$project/build}")
[ -e "$build/docs/parameters.md" ] || { echo "$build/docs has no pages: build all programs first (./samples/demo.sh --all)" >&2; exit 2; }
work=$(mktemp -d "${TMPDIR:-/tmp}/mbtfm-site.XXXXXX")
trap 'rm -rf "$work"' EXIT
python3 - "$project" "$work" "$out" "$build" <<'PYTHON'
"""Copies the pages and what they link to, at the same relative places, and writes mkdocs.yml."""
import json
import os
import re
import shutil
import sys

project, work, out, build = sys.argv[1:]
pages = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "python/README.md", "samples/README.md"]
for folder, _, files in os.walk(os.path.join(project, "docs")):
    pages += [os.path.relpath(os.path.join(folder, f), project) for f in files if f.endswith(".md")]
made = [os.path.join("docs", f) for f in ("parameters.md", "columns.md", "findings.md", "plausible.md")]
pages += made


def read(page):
    with open(os.path.join(build if page in made else project, page), encoding="utf-8") as file:
        return file.read()


def copied(path):
    target = os.path.join(work, "pages", path)
    os.makedirs(os.path.dirname(target), exist_ok=True)
    return target


def as_mkdocs_reads(text):
    """A list needs an empty line before it, unlike on GitHub."""
    lines, is_code = [], False
    for line in text.split("\n"):
        if line.lstrip().startswith("```"):
            is_code = not is_code
        is_item = re.match(r"([-*]|\d+\.) ", line) and not is_code
        before = lines[-1] if lines else ""
        if is_item and before and not re.match(r"([-*]|\d+\.) | ", before):
            lines.append("")
        lines.append(line)
    return "\n".join(lines)


links = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
for page in pages:
    text = read(page)
    with open(copied(page), "w", encoding="utf-8") as file:
        file.write(as_mkdocs_reads(text))
    for link in links.findall(text):
        linked = os.path.normpath(os.path.join(os.path.dirname(page), link))
        source = os.path.join(project, linked)
        if os.path.isfile(source) and not linked.endswith(".md"):
            shutil.copyfile(source, copied(linked))

menu, named = [{"mbtfm": "README.md"}, {"All pages": "docs/README.md"}], {"README.md", "docs/README.md"}
for chapter in re.split(r"\n## ", read("docs/README.md"))[1:]:
    entries = []
    for title, link in re.findall(r"\[([^\]]*)\]\(([^)#:\s]+\.md)\)", chapter):
        page = os.path.normpath(os.path.join("docs", link))
        if page not in named:
            entries.append({title: page})
            named.add(page)
    menu.append({chapter.split("\n")[0]: entries})
rest = [page for page in pages if page not in named and page not in ("CHANGELOG.md", "samples/README.md")]
if rest:
    sys.exit("docs/README.md does not name " + ", ".join(rest))
menu.append({"More": [{"Samples": "samples/README.md"}, {"Changes": "CHANGELOG.md"}]})

settings = {
    "site_name": "mbtfm", "docs_dir": os.path.join(work, "pages"), "site_dir": out, "use_directory_urls": False,
    "theme": {"name": "mkdocs", "highlightjs": False, "nav_style": "light"}, "plugins": ["search"],
    "markdown_extensions": ["tables", "fenced_code", "toc"], "nav": menu}
with open(os.path.join(work, "mkdocs.yml"), "w", encoding="utf-8") as file:
    json.dump(settings, file)  # which is YAML, too
PYTHON
mkdocs build --strict --clean --config-file "$work/mkdocs.yml" >"$work/log" 2>&1 || { grep -v ^INFO "$work/log" >&2; exit 1; }
echo "$out/index.html"
