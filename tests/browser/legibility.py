"""The type of a page: size, spacing and contrast of every text that is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from playwright.sync_api import Page

# Goes through the text nodes of the page. Colours behind a text are put over one another from the
# outside in; a text over a picture, a canvas or the scene has no colour behind it that is known.
READ = """(within) => {
    const probe = Object.assign(document.createElement("canvas"), { width: 1, height: 1 });
    const pen = probe.getContext("2d", { willReadFrequently: true });
    const parsed = new Map();
    const rgba = (text) => {
        if (!parsed.has(text)) {
            pen.clearRect(0, 0, 1, 1);
            pen.fillStyle = text;
            pen.fillRect(0, 0, 1, 1);
            const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
            parsed.set(text, [r, g, b, a / 255]);
        }
        return parsed.get(text);
    };
    const over = (top, below) => {
        const share = top[3];
        return [0, 1, 2].map((k) => top[k] * share + below[k] * (1 - share));
    };
    const linear = (value) => {
        const share = value / 255;
        return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    };
    const luminance = ([r, g, b]) =>
        0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
    const behind = (element) => {
        const layers = [];
        for (let each = element; each; each = each.parentElement) {
            const style = getComputedStyle(each);
            layers.push([rgba(style.backgroundColor), Number(style.opacity)]);
        }
        // The page itself is white or black below all else.
        let colour = rgba(getComputedStyle(document.body).backgroundColor).slice(0, 3);
        for (const [[r, g, b, a], opacity] of layers.reverse()) {
            colour = over([r, g, b, a * opacity], colour);
        }
        return colour;
    };
    const opacityOf = (element) => {
        let product = 1;
        for (let each = element; each; each = each.parentElement) {
            product *= Number(getComputedStyle(each).opacity);
        }
        return product;
    };
    const isSeen = (element, rect) => {
        if (rect.width < 1 || rect.height < 1) return false;
        return element.checkVisibility({ opacityProperty: true, visibilityProperty: true });
    };
    const texts = [];
    const note = (element, text, isDisabled) => {
        const style = getComputedStyle(element);
        const isDrawn = element instanceof SVGElement;
        const scale = isDrawn ? element.getScreenCTM().a : 1;
        const own = rgba(isDrawn ? style.fill : style.color);
        const share = opacityOf(element) * (isDrawn ? Number(style.fillOpacity) : 1);
        const ground = behind(element);
        const colour = over([own[0], own[1], own[2], own[3] * share], ground);
        const [high, low] = [luminance(colour), luminance(ground)].sort((a, b) => b - a);
        texts.push({
            text,
            size: Number.parseFloat(style.fontSize) * scale,
            spacing: Number.parseFloat(style.letterSpacing) || 0,
            contrast: (high + 0.05) / (low + 0.05),
            isDisabled,
            place: element.closest("[class]")?.getAttribute("class") ?? element.tagName,
        });
    };
    const nodes = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = nodes.nextNode(); node; node = nodes.nextNode()) {
        const text = node.data.trim(),
            element = node.parentElement;
        if (within && !element.closest(within)) continue;
        if (!text || element.closest("script, style, #webgl-software-rendering")) continue;
        const range = document.createRange();
        range.selectNodeContents(node);
        const isDisabled = !!element.closest(":disabled, [data-disabled], [aria-disabled=true]");
        if (isSeen(element, range.getBoundingClientRect())) note(element, text, isDisabled);
    }
    for (const field of document.querySelectorAll("input:not([type=hidden]), textarea")) {
        if (within && !field.closest(within)) continue;
        if (!field.value || field.type === "checkbox") continue;
        if (isSeen(field, field.getBoundingClientRect()))
            note(field, field.value, field.disabled);
    }
    return texts;
}"""

# The contrast of elements with the page: of a drawing, of a gradient, or of a background.
MARK_CONTRASTS = """(selector) => {
    const pen = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    const page = getComputedStyle(document.body).backgroundColor;
    const luminance = (colour) => {
        for (const each of [page, colour]) {
            pen.fillStyle = each;
            pen.fillRect(0, 0, 1, 1);
        }
        const parts = [...pen.getImageData(0, 0, 1, 1).data].slice(0, 3).map((value) =>
            value <= 10 ? value / 3294 : ((value / 255 + 0.055) / 1.055) ** 2.4);
        return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2];
    };
    const [of, part] = selector.split("::");
    return [...document.querySelectorAll(of)].filter((each) => each.checkVisibility())
        .map((each) => {
            const style = getComputedStyle(each, part && `::${part}`);
            const { color, backgroundColor, backgroundImage } = style;
            const first = backgroundImage.match(/(?:rgb|color)a?\\([^)]*\\)/)?.[0];
            const own = each instanceof SVGElement ? color : first ?? backgroundColor;
            const [high, low] = [own, page].map(luminance).sort((a, b) => b - a);
            return (high + 0.05) / (low + 0.05);
        });
}"""

# Open the folders that are seen and closed, all in one look: the page itself opens a little later
# those that were open when their tab was in front before. Return how many there were.
OPEN_FOLDERS = """() => {
    const heads = document.querySelectorAll(
        ".mantine-Paper-root > .mantine-Paper-root:first-child:has(> .tabler-icon-chevron-down)");
    const closed = [...heads].filter((each) => each.checkVisibility({ visibilityProperty: true }));
    for (const each of closed) each.click();
    return closed.length;
}"""


@dataclass(frozen=True)
class Text:
    """A text of a page.

    Attributes:
        text: The text.
        size: Size of its type as it is drawn, in pixels.
        spacing: Space between its letters beyond that of the font, in pixels.
        contrast: Ratio of contrast with what is behind it, as WCAG 2 defines it.
        is_disabled: Whether it belongs to a control that is disabled.
        place: Classes of the element around it.
    """

    text: str
    size: float
    spacing: float
    contrast: float
    is_disabled: bool
    place: str


def texts_of(page: Page, within: str = "") -> list[Text]:
    """Return the texts that are seen on a page.

    Args:
        page: The page.
        within: Selector of the elements whose texts are meant; "" for all of the page.
    """
    found: list[dict[str, Any]] = page.evaluate(READ, within)
    return [
        Text(
            each["text"],
            each["size"],
            each["spacing"],
            each["contrast"],
            each["isDisabled"],
            each["place"],
        )
        for each in found
    ]


def open_folders(page: Page) -> None:
    """Open the folders that are seen and closed, and those in them."""
    while page.evaluate(OPEN_FOLDERS):
        pass


def mark_contrasts(page: Page, selector: str) -> list[float]:
    """Return the ratios of contrast of what is seen by its shape alone with the page behind it.

    Args:
        page: The page.
        selector: Selector of the elements, of their ::before or ::after if it ends with that.
    """
    return page.evaluate(MARK_CONTRASTS, selector)
