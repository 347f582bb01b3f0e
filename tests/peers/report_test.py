# peers - the page of a diagnosis in a real browser: zoom, hover, what is shown; dark, narrow, on paper, without JavaScript.
#
#   report_test.py ARMCAL FOLDER
# The logs are made here: a planar arm of two links by its closed form, with a ripple of joint 2 that no model declares. What
# a reader reads under the pointer is compared with the numbers of the log. Pictures of the page go to FOLDER.
import pathlib
import re
import subprocess
import sys

import numpy as np

sys.dont_write_bytecode = True
from browser import NARROW, PAPER, Opened, chromium, pictures

SECONDS, RATE_HZ = 24.0, 250
MOST_BYTES = 1_500_000
RIPPLE_NM, RIPPLE_PER_RAD = 0.9, 20.0


def motion(t, random):
    """Position, speed and acceleration: a sum of sines."""
    q, v, a = (np.zeros((len(t), 2)) for _ in range(3))
    for joint in range(2):
        for k in range(1, 6):
            w = 2 * np.pi * k / 12
            size, phase = random.uniform(0.2, 0.6) / k**0.5, random.uniform(0, 2 * np.pi)
            q[:, joint] += size * np.sin(w * t + phase)
            v[:, joint] += size * w * np.cos(w * t + phase)
            a[:, joint] -= size * w * w * np.sin(w * t + phase)
    return q, v, a


def torque(q, v, a):
    """Two links of 3 and 2 kg, 0.5 m apart, centres 0.2 m along each; gravity along -y; friction; the ripple."""
    m, c, inertia, length, g = (3.0, 2.0), (0.2, 0.2), (0.05, 0.03), 0.5, 9.81
    cos2, sin2 = np.cos(q[:, 1]), np.sin(q[:, 1])
    m11 = inertia[0] + inertia[1] + m[0] * c[0]**2 + m[1] * (length**2 + c[1]**2 + 2 * length * c[1] * cos2) + 0.05
    m12 = inertia[1] + m[1] * (c[1]**2 + length * c[1] * cos2)
    m22 = inertia[1] + m[1] * c[1]**2 + 0.025
    h = m[1] * length * c[1] * sin2
    g2 = m[1] * c[1] * g * np.cos(q[:, 0] + q[:, 1])
    g1 = (m[0] * c[0] + m[1] * length) * g * np.cos(q[:, 0]) + g2
    one = m11 * a[:, 0] + m12 * a[:, 1] - h * (2 * v[:, 0] * v[:, 1] + v[:, 1]**2) + g1 + 2 * np.sign(v[:, 0]) + v[:, 0]
    two = m12 * a[:, 0] + m22 * a[:, 1] + h * v[:, 0]**2 + g2 + np.sign(v[:, 1]) + 0.5 * v[:, 1]
    two += RIPPLE_NM * np.cos(RIPPLE_PER_RAD * q[:, 1])
    return np.stack([one, two], axis=1)


def write_log(path, seed):
    random = np.random.default_rng(seed)
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    q, v, a = motion(t, random)
    tau = torque(q, v, a) + random.normal(0, 0.1, q.shape)
    np.savetxt(path, np.column_stack([t, q, tau]), delimiter=",", header="t,q1,q2,tau1,tau2", comments="", fmt="%.9g")
    return t, tau


def values(chart):
    """What stands above a chart: {"time": ..., "measured": ...}."""
    text = chart.locator(".head").inner_text()
    found = {name: float(number) for name, number in re.findall(r"(measured|predicted before|predicted after) (-?[\d.e+-]+)", text)}
    at = re.search(r"at time (-?[\d.e+-]+) s", text)
    return found | ({"time": float(at.group(1))} if at else {})


def pointer_on(page, chart, share):
    box = chart.locator(".chart").bounding_box()
    left = 70  # where the axis' numbers stand
    page.mouse.move(box["x"] + left + share * (box["width"] - left), box["y"] + box["height"] / 2, steps=4)
    page.wait_for_timeout(60)


def check_hover(page, chart, log):
    t, tau = log
    seen = 0
    for share in (0.1, 0.35, 0.6, 0.85):
        pointer_on(page, chart, share)
        shown = values(chart)
        nearest = np.argmin(np.abs(t - shown["time"]))
        assert abs(t[nearest] - shown["time"]) < 1e-3, shown
        assert abs(tau[nearest, 1] - shown["measured"]) <= 1e-3 * abs(tau[nearest, 1]) + 1e-4, (shown, tau[nearest, 1])
        seen += "predicted after" in shown and abs(shown["predicted after"] - shown["measured"]) < 1.0
    assert seen >= 2, "a prediction stands beside the measured torque wherever the joint moves"


def check_zoom(page, figure, chart):
    whole = figure.get_by_role("button", name="whole range")
    assert not whole.is_visible()
    times = []
    for share in (0.25, 0.5):
        pointer_on(page, chart, share)
        times.append(values(chart)["time"])
        page.mouse.down() if share == 0.25 else page.mouse.up()
    for share, expected in ((0.01, times[0]), (0.99, times[1])):
        pointer_on(page, chart, share)
        assert abs(values(chart)["time"] - expected) < 0.03 * SECONDS, (values(chart), times)
    assert whole.is_visible()
    whole.click()
    assert not whole.is_visible()
    pointer_on(page, chart, 0.99)
    assert values(chart)["time"] > 0.95 * SECONDS
    print(f"zoom: from {times[0]:.2f} to {times[1]:.2f} s and back")


def check_what_is_shown(page, figure):
    panels = figure.locator(".panel:visible")
    assert panels.count() == 1, "the joint with the cause"
    figure.get_by_role("button", name="joint 1").click()
    assert panels.count() == 2
    figure.get_by_role("button", name="joint 1").click()
    assert panels.count() == 1
    chart = panels.first
    pointer_on(page, chart, 0.6)
    torque_there = values(chart)
    figure.get_by_role("button", name="measured minus predicted").click()
    pointer_on(page, chart, 0.6)
    left = values(chart)
    assert "measured" not in left and left["time"] == torque_there["time"], left
    for name in ("predicted before", "predicted after"):
        if name in torque_there:
            assert abs(torque_there["measured"] - torque_there[name] - left[name]) < 0.02, (name, torque_there, left)
    figure.get_by_role("button", name="measured minus predicted").click()
    figure.get_by_role("button", name="predicted before").click()
    assert "predicted before" not in chart.locator(".head").inner_text()
    figure.get_by_role("button", name="predicted before").click()


def check_live(browser, path, log):
    with Opened(browser, path) as opened:
        page = opened.page
        assert page.locator(".box").first.bounding_box()["y"] < 300, "the verdict stands on the first screen"
        assert page.locator(".still:visible").count() == 0
        figure = page.locator(".live").first
        figure.scroll_into_view_if_needed()
        page.evaluate("scrollTo(0, document.querySelector('.live').getBoundingClientRect().top + scrollY - 100)")
        chart = figure.locator(".panel:visible").first
        check_hover(page, chart, log)
        check_zoom(page, figure, chart)
        check_what_is_shown(page, figure)
        for other in page.locator(".live .panel:visible").all():  # the other charts, a logarithmic one among them
            other.scroll_into_view_if_needed()
            pointer_on(page, other, 0.5)
            assert re.search(r"at .+ \d", other.locator(".head").inner_text()), other.locator(".head").inner_text()
        assert opened.complaints == [], opened.complaints


def ink(page, selector):
    """Whether what selector finds is darker than what it stands on."""
    shades = page.evaluate("""selector => ['color', 'backgroundColor'].map((name, k) => {
        const at = k === 0 ? document.querySelector(selector) : document.body;
        return getComputedStyle(at)[name].match(/\\d+/g).slice(0, 3).reduce((sum, v) => sum + Number(v), 0); })""", selector)
    assert abs(shades[0] - shades[1]) > 300, (selector, shades)
    return shades[0] < shades[1]


def check_layouts(browser, path):
    with Opened(browser, path, scheme="dark") as opened:
        assert not ink(opened.page, "h1") and not ink(opened.page, ".dygraph-axis-label")
        opened.page.emulate_media(color_scheme="light")
        assert ink(opened.page, "h1")
        opened.page.emulate_media(media="print", color_scheme="dark")
        assert ink(opened.page, "h1"), "paper is white at night, too"
        assert opened.complaints == [], opened.complaints
    with Opened(browser, path, size=PAPER) as opened:
        opened.page.emulate_media(media="print")
        assert opened.page.locator(".live:visible").count() == 0
        assert opened.page.locator(".still svg:visible").count() >= 5
    with Opened(browser, path, size=NARROW) as opened:
        wide = opened.page.evaluate("document.documentElement.scrollWidth")
        assert wide <= NARROW[0], f"the page is {wide} px wide"
        assert opened.complaints == [], opened.complaints
    with Opened(browser, path, javascript=False) as opened:
        assert "The model lacks 1 effect" in opened.page.locator(".box").first.inner_text()
        assert opened.page.locator(".still svg:visible").count() >= 5 and opened.page.locator("table:visible").count() >= 2


def check_hostile_names(browser, program, folder):
    robot = (pathlib.Path(__file__).parents[2] / "codegen/robots/two_link.toml").read_text()
    hostile = "</script><img src=x onerror=alert(1)>"
    robot = robot.replace('title = "', f'title = "{hostile}').replace('name = "elbow', f'name = "{hostile}elbow')
    (folder / "hostile.toml").write_text(robot)
    page = folder / "hostile.html"
    make_page(program, folder, folder / "hostile.toml", page)
    with Opened(browser, page) as opened:
        assert "elbow" in opened.page.locator(".live .head b").first.inner_text()
        assert opened.complaints == [], opened.complaints


def check_other_pages(browser, program, folder):
    """The pages of identify and of diagnose --splits: they open without a complaint, and their charts show values."""
    runs = [folder / f"run{k}.csv" for k in range(3)]
    for k, run in enumerate(runs):
        write_log(run, 10 + k)
    pages = {"identified": ["identify", "--train", runs[0], "--test", runs[1]], "splits": ["diagnose", "--splits", *runs, "--out", folder / "splits"]}
    for name, words in pages.items():
        page = folder / f"{name}.html"
        subprocess.run([program, *words, "--robot", "two_link", "--report", page], check=True, stdout=subprocess.DEVNULL)
        assert page.stat().st_size <= MOST_BYTES, (name, page.stat().st_size)
        for how in ({}, {"size": NARROW}, {"scheme": "dark"}, {"javascript": False}):
            with Opened(browser, page, **how) as opened:
                assert opened.page.locator("svg:visible, canvas:visible").count() >= 1, (name, how)
                if "javascript" not in how:
                    assert opened.page.evaluate("document.documentElement.scrollWidth") <= (NARROW[0] if "size" in how else 1400), name
                for chart in opened.page.locator(".live .panel:visible").all():
                    chart.scroll_into_view_if_needed()
                    pointer_on(opened.page, chart, 0.5)
                    assert re.search(r"at .+ \d", chart.locator(".head").inner_text()), (name, how)
                assert opened.complaints == [], (name, how, opened.complaints)


def make_page(program, folder, robot, page):
    subprocess.run([program, "diagnose", "--robot", robot, "--train", folder / "train.csv", "--test", folder / "test.csv",
                    "--report", page], check=True, stdout=subprocess.DEVNULL)


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    write_log(folder / "train.csv", 1)
    log = write_log(folder / "test.csv", 2)
    page = folder / "report.html"
    make_page(program, folder, "two_link", page)
    assert page.stat().st_size <= MOST_BYTES, page.stat().st_size
    with chromium() as browser:
        check_live(browser, page, log)
        check_layouts(browser, page)
        check_hostile_names(browser, program, folder)
        check_other_pages(browser, program, folder)
        pictures(browser, page, folder, "report")
    print(f"report: {page.stat().st_size} bytes; zoom, hover, dark, print, narrow and no JavaScript hold")


main()
