"""``python -m tests.report.screenshots SEARCH.html BATCH.html [FOLDER]``: the pictures of docs/page.md."""

from __future__ import annotations

import io
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

from tests.report.conftest import BROWSERS

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "page"
VIEW = "fibrefit.view(document.querySelector('.records').id)"
HEIGHT, PRINTED = 1000, 690
"""Of a window, in pixels; width of a sheet of A4 between its margins, at 96 pixels an inch."""
COLOURS = 256
"""A page has few: a fifth of the bytes. They are chosen to cover all there are, so that thin lines keep theirs."""
LONGEST = 2600
"""Rows of a picture of a whole page that are kept."""


def keep(png: bytes, file: Path) -> None:
    """Keep a picture with few colours."""
    image = Image.open(io.BytesIO(png)).convert("RGB")
    image = image.crop((0, 0, image.width, min(LONGEST, image.height)))
    image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(file, optimize=True)


def first(tab: Any) -> None:
    """What is seen when the page is opened, its records drawn."""
    if tab.locator(".records").count():
        tab.evaluate(f"{VIEW}.ready")


def zoomed(tab: Any) -> None:
    """The record at the first place where the model goes wrong, with its readout."""
    tab.evaluate(f"{VIEW}.ready")
    tab.evaluate(f"{VIEW}.goTo(0)")
    tab.wait_for_timeout(800)
    tab.evaluate("document.querySelector('.records').scrollIntoView()")
    box = tab.locator(".panel .u-over").first.bounding_box()
    tab.mouse.move(box["x"] + 0.45 * box["width"], box["y"] + 60)
    tab.wait_for_timeout(300)


def moments(tab: Any) -> None:
    """A moment of all records over one another."""
    zoomed(tab)
    tab.locator(".moments button").nth(1).click()
    tab.wait_for_timeout(900)
    tab.evaluate("document.querySelector('.moments').scrollIntoView()")
    tab.wait_for_timeout(300)


def everything(tab: Any) -> None:
    """All items of a batch."""
    tab.evaluate("document.querySelector('.items').scrollIntoView()")
    tab.wait_for_timeout(300)


def filtered(tab: Any) -> None:
    """A batch of which some items are left, in order of a column."""
    tab.locator(".items input").fill("gap > 1.05")
    tab.locator("thead button", has_text="gap").first.click()
    tab.wait_for_timeout(400)


WIDE, NARROW = 1280, 400


def _shots() -> dict[str, tuple[str, Callable[[Any], None], int, str, str]]:
    """Name of a picture: page, what is done to it, width, scheme, medium."""
    both = ("light", "dark")
    seen = {
        "search": ("search", first, first),
        "records": ("search", zoomed, zoomed),
        "batch": ("batch", filtered, everything),
    }
    shots = {
        f"{name}_{width}_{scheme}": (page, act, width, scheme, "screen")
        for name, (page, *acts) in seen.items()
        for width in (WIDE, NARROW)
        for scheme, act in zip(both, acts, strict=True)
    }
    printed = {f"{page}_print": (page, first, PRINTED, "light", "print") for page in ("search", "batch")}
    return shots | {"moments_1280_dark": ("search", moments, WIDE, "dark", "screen")} | printed


def main() -> None:
    pages = {"search": Path(sys.argv[1]), "batch": Path(sys.argv[2])}
    folder = Path(sys.argv[3]) if len(sys.argv) > 3 else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name, (page, act, width, scheme, medium) in _shots().items():
            tab = browser.new_page(viewport={"width": width, "height": HEIGHT}, color_scheme=scheme)
            tab.emulate_media(media=medium, color_scheme=scheme)
            tab.goto(pages[page].resolve().as_uri())
            act(tab)
            # A sheet, or the long page of a telephone, is one picture; else what is seen without scrolling.
            keep(tab.screenshot(full_page=width != WIDE and act is not zoomed), folder / f"{name}.png")
            tab.close()
        browser.close()


if __name__ == "__main__":
    main()
