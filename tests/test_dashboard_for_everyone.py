"""The dashboard for everyone: by keyboard alone, with reduced motion, enlarged; and a recording in each size and theme."""

from test_dashboard_pages import AXE, PAGES, SIZES, address_of, chromium, photograph, screens, serious, watched  # noqa: F401

# What can be acted on and is in view, but for what arrows reach inside a group.
CONTROLS = """() => [...document.querySelectorAll("button, a[href], input, select, textarea, [tabindex='0']")].filter((each) =>
  !each.disabled && each.tabIndex >= 0 && each.getClientRects().length > 0 && getComputedStyle(each).visibility !== "hidden").length"""
# How often a second anything is drawn into a canvas.
DRAWN = """() => {
  const times = new Set();
  for (const name of ["stroke", "fillRect", "drawImage"]) {
    const own = CanvasRenderingContext2D.prototype[name];
    CanvasRenderingContext2D.prototype[name] = function (...rest) {
      times.add(Math.round(document.timeline.currentTime));
      return own.apply(this, rest);
    };
  }
  window.drawnTimes = times;
}"""


def test_every_control_is_reached_by_keyboard_and_has_a_ring(stage, screens):  # noqa: F811
    monitor, _, address, _ = watched(stage)
    screen = screens(address)
    page = screen.page
    page.wait_for_selector(".robot[data-state=online]")
    for key, name in enumerate(PAGES, 1):
        page.keyboard.press(str(key))
        page.wait_for_url(f"**#/{name}")
        page.wait_for_timeout(500)
        page.evaluate("document.activeElement?.blur()")
        first, reached, ringless = None, set(), []
        for _ in range(150):
            page.keyboard.press("Tab")
            focused = page.evaluate("""() => {
              const each = document.activeElement;
              if (!each || each === document.body) return null;
              window.controls ??= new WeakMap();
              window.countedControls ??= 0;
              if (!window.controls.has(each)) window.controls.set(each, window.countedControls++);
              return [window.controls.get(each), getComputedStyle(each).outlineStyle, each.outerHTML.slice(0, 120)];
            }""")
            if focused is None or (reached and focused[0] == first):
                break
            first = first if reached else focused[0]
            reached.add(focused[0])
            if focused[1] == "none":
                ringless.append(focused[2])
        assert not ringless, (name, ringless)
        assert len(reached) >= 0.9 * page.evaluate(CONTROLS), name
    page.keyboard.press("?")
    page.wait_for_selector("dialog >> text=acknowledge the oldest alert")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    assert monitor.interrupt() == 0, monitor.report()


def test_with_reduced_motion_strips_step(stage, screens):  # noqa: F811
    monitor, _, address, _ = watched(stage)
    page = screens(address).page
    page.emulate_media(reduced_motion="reduce")
    page.reload()
    page.goto(f"{address}#/signals")
    page.wait_for_selector(".sig .now b:not(:text('–'))", state="attached", timeout=90_000)
    page.evaluate(DRAWN)
    page.wait_for_timeout(3000)
    drawn = page.evaluate("window.drawnTimes.size") / 3
    assert 0 < drawn <= 8, drawn
    assert monitor.interrupt() == 0, monitor.report()


def test_a_recording_is_shown_in_each_size_and_theme(stage, demo_bag, screens):  # noqa: F811
    player = stage.teampulse("play", demo_bag, "--no-ros")
    address = address_of(player)
    for name, size in SIZES.items():
        for theme in ("light", "dark"):
            screen = screens(address, size=size, theme=theme, linked="connected")
            page = screen.page
            page.wait_for_selector("[data-testid=position]")
            page.wait_for_selector("button[aria-label=Play], button[aria-label=Pause]")
            if page.locator("button[aria-label=Pause]").count():
                page.keyboard.press("Space")
            page.keyboard.press("End")
            for each in ("team", "signals", "session"):
                screen.go(each)
                there = {"team": ".light[data-state=ok]", "signals": ".sig .now b:not(:text('–'))", "session": ".log time"}
                page.wait_for_selector(there[each], state="attached")
                page.wait_for_timeout(800)
                photograph(page, f"replay-{each}-{name}-{theme}.png", size)
                if AXE.exists() and name != "1920x1080":
                    assert serious(page) == [], f"{each}, {name}, {theme}"
                # Nothing is wider than the screen: a phone scrolls down only.
                assert page.evaluate("document.documentElement.scrollWidth") <= size[0], (each, name)


def test_twice_as_large_it_is_the_page_of_a_phone(stage, screens):  # noqa: F811
    monitor, _, address, _ = watched(stage)
    # 1280 pixels at 200 % are 640 for the page.
    screen = screens(address, size=(640, 360))
    for name in PAGES:
        screen.go(name)
        screen.page.wait_for_timeout(500)
        assert screen.page.evaluate("document.documentElement.scrollWidth") <= 640, name
    assert monitor.interrupt() == 0, monitor.report()
