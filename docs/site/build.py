# docs - makes the site of the pages in docs, of the program's own help, and of the comments of lib.
#
#   build.py CHECKOUT ARMCAL FOLDER
# FOLDER holds the site afterwards; FOLDER.source holds what Sphinx reads. A warning of Sphinx, such as a dead link, ends the build.
import pathlib
import re
import shutil
import subprocess
import sys

TOP, ARMCAL, SITE = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
SOURCE = SITE.with_name(SITE.name + ".source")
PAGES = ["*.md", "docs/*.md", "port/*.md", "host_sim/scenarios/*.md"]
OTHERS = ["docs/*.png", "docs/*.svg", "docs/rooms.dot", "docs/concepts/*", "docs/effects/*", "docs/findings/*", "docs/report/*", "toolchains/budgets.toml"]


def run(*words, **more):
    done = subprocess.run([str(word) for word in words], text=True, capture_output=True, **more)
    if done.returncode != 0:
        sys.exit(f"{words[0]}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def write(name, text):
    (SOURCE / name).parent.mkdir(parents=True, exist_ok=True)
    (SOURCE / name).write_text(text)


def verbs():
    text = "# The verbs of armcal\n\nThis is what `armcal VERB --help` prints.\n"
    listed = run(ARMCAL, "--help").split("Subcommands:")[1]
    for verb in re.findall(r"^  (\w+)", listed, re.MULTILINE):
        shown = run(ARMCAL, verb, "--help").replace(str(ARMCAL), "armcal")
        text += f"\n## {verb}\n\n```text\n{shown.strip()}\n```\n"
    write("docs/verbs.md", text)


def registers():
    listed = re.sub("^### ", "## ", run(ARMCAL, "map", "--md"), flags=re.MULTILINE)
    write("docs/registers.md", "# Registers\n\nThis is what `armcal map --md` prints.\n\n" + listed)


# docs/README.md lists the pages by sections. Sphinx needs the same list in its own words.
def contents():
    text = (SOURCE / "README.md").read_text() + "\n```{toctree}\n:hidden:\n\nContents <docs/README>\n```\n"
    for section in (SOURCE / "docs/README.md").read_text().split("\n## ")[1:]:
        title, *lines = section.splitlines()
        links = [re.fullmatch(r"- \[(.*)\]\((.*)\.md\)", line) for line in lines if line]
        pages = [f"{m[1]} <{(pathlib.PurePosixPath('docs') / m[2])}>".replace("docs/../", "") for m in links]
        if title == "Reference":
            pages = ["The verbs <docs/verbs>", "Registers <docs/registers>", "Classes and functions <docs/api>", *pages]
        text += f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n" + "\n".join(pages) + "\n```\n"
    write("README.md", text)


# The comments of lib are plain. The filter marks those that stand before a declaration or behind one.
def api():
    filter_ = r"""sed -E 's,^( *)// ,\1/// ,; s,([;{])  // ,\1  ///< ,'"""
    settings = {
        "PROJECT_NAME": "armcal", "INPUT": TOP / "lib/armcal", "RECURSIVE": "YES", "EXTRACT_ALL": "YES", "STRIP_FROM_PATH": TOP / "lib",
        "STRIP_FROM_INC_PATH": TOP / "lib", "GENERATE_LATEX": "NO", "HAVE_DOT": "NO", "QUIET": "YES", "WARNINGS": "NO",
        "OUTPUT_DIRECTORY": SITE, "HTML_OUTPUT": "api", "FILE_PATTERNS": "*.hpp", "JAVADOC_AUTOBRIEF": "YES",
        "INPUT_FILTER": f'"{filter_}"', "SHOW_INCLUDE_FILES": "NO", "FULL_PATH_NAMES": "YES",
    }
    write("docs/api.md", '# Classes and functions\n\n<a href="../api/index.html">The library, made of its headers by Doxygen</a>\n')
    run("doxygen", "-", input="\n".join(f"{key} = {value}" for key, value in settings.items()))


for folder in (SITE, SOURCE):
    shutil.rmtree(folder, ignore_errors=True)
for pattern in PAGES + OTHERS:
    for file in TOP.glob(pattern):
        to = SOURCE / file.relative_to(TOP)
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, to)
verbs()
registers()
contents()
api()
run("sphinx-build", "-q", "-W", "--keep-going", "-b", "html", "-c", TOP / "docs/site", SOURCE, SITE)
shutil.copy(SITE / "README.html", SITE / "index.html")
print(f"{SITE / 'index.html'}")
