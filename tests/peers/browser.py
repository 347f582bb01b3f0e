# peers - opens a page from disk in Debian's chromium, without a network, and takes pictures of it.
#
#   browser.py PAGE FOLDER NAME
# writes FOLDER/NAME.png, NAME_narrow.png, NAME_dark.png and NAME_print.png: what a reader sees first on a wide and on a
# narrow screen, at night, and on paper.
import contextlib
import pathlib
import sys

from playwright.sync_api import sync_playwright

CHROMIUM = "/usr/bin/chromium"
WIDE, NARROW, PAPER = (1400, 1040), (420, 1400), (860, 1216)


@contextlib.contextmanager
def chromium():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


class Opened:
    """A page, and what went wrong while it was open."""

    def __init__(self, browser, path, size=WIDE, scheme="light", javascript=True):
        self.context = browser.new_context(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme,
                                           java_script_enabled=javascript, offline=True)
        self.page = self.context.new_page()
        self.complaints = []
        self.page.on("console", lambda message: self.complaints.append("console: " + message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(f"error: {error}"))
        self.page.on("dialog", lambda dialog: (self.complaints.append("dialog"), dialog.dismiss()))
        self.url = pathlib.Path(path).resolve().as_uri()
        self.page.on("request", lambda request: request.url == self.url or self.complaints.append("asks for " + request.url[:100]))
        self.page.goto(self.url)
        self.page.wait_for_timeout(200)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.context.close()


def pictures(browser, path, folder, name):
    for suffix, how in (("", {}), ("_narrow", {"size": NARROW}), ("_dark", {"scheme": "dark"}), ("_print", {"size": PAPER})):
        with Opened(browser, path, **how) as opened:
            if suffix == "_print":
                opened.page.emulate_media(media="print")
            opened.page.screenshot(path=f"{folder}/{name}{suffix}.png")


if __name__ == "__main__":
    with chromium() as program:
        pictures(program, *sys.argv[1:4])
