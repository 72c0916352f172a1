"""A browser that draws with Mesa where that is there.

Chromium's own software renderer compiles every shader anew in every page, which takes some
ten seconds of the processor; Mesa keeps them on disk.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from playwright.sync_api import Browser

from explorer.page.browser.headless import SWIFTSHADER, headless_browser

# The page itself is drawn by the processor at once, rather than by a renderer that imitates a
# graphics card.
WITHOUT_COMPOSITOR = ("--disable-gpu-compositing",)
MESA = ("--use-angle=gl-egl", "--ignore-gpu-blocklist", *WITHOUT_COMPOSITOR)
# Its software renderer, whatever else the machine has.
IN_SOFTWARE = {"LIBGL_ALWAYS_SOFTWARE": "1", "EGL_PLATFORM": "surfaceless"}
RENDERER = """() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl && gl.getExtension("WEBGL_debug_renderer_info");
  return names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "none";
}"""


@contextmanager
def quick_browser() -> Generator[Browser]:
    """Start a headless Chromium with the quicker of the software renderers that it has."""
    with headless_browser(MESA, IN_SOFTWARE) as browser:
        if "llvmpipe" in renderer_of(browser):
            yield browser
            return
    with headless_browser((*SWIFTSHADER, *WITHOUT_COMPOSITOR)) as browser:
        yield browser


def renderer_of(browser: Browser) -> str:
    """Return the name of what draws in a browser."""
    page = browser.new_page()
    try:
        return str(page.evaluate(RENDERER))
    finally:
        page.close()
