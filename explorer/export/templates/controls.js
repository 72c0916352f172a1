// The page: its state is one pose; sliders, modes and keys move it, and all that is shown follows.
window.startPage = (design, link) => {
  const mechanism = window.flagged44(design);
  const { along, dot, column, inverse, margins, forward, fromFolds, toFolds } = mechanism;
  const find = (id) => document.getElementById(id);
  const DEGREE = Math.PI / 180;
  const { reach, colours } = design;
  // The unit of sizes that are drawn; the reach has twenty.
  const u = reach / 20;
  const decimals = Math.max(0, Math.min(6, 4 - Math.ceil(Math.log10(reach))));
  const MARGINS = design.incidences.map((words, i) => ({
    name: `δ${i + 1}`,
    fold: `φ${i + 1}`,
    words,
  }));
  const TABS = {
    pose: ["x", "y", "z", "yaw", "pitch", "roll"],
    joints: ["l1", "d1", "d2", "d3", "d4", "l4"],
    folds: ["r", "β", "ε", "φ1", "φ2", "φ3"],
  };
  const HALF = { yaw: 180, pitch: 90, roll: 180, β: 180, ε: 180, φ1: 180, φ2: 180, φ3: 180 };

  const MOST_DECIMALS = 15;
  const write = (value, places = decimals) => {
    const text = Math.abs(value).toFixed(places);
    return (value < 0 && Number(text) > 0 ? "−" : "") + text;
  };
  // A typed number in mm or degrees, with a point or a comma and perhaps a unit; null if it is none.
  const LENGTHS = { "": 1, mm: 1, cm: 10, m: 1000, in: 25.4 };
  const ANGLES = { "": 1, "°": 1, deg: 1, rad: 1 / DEGREE };
  const read = (text, units) => {
    const plain = text.trim().replace("−", "-").replace(",", ".");
    const [, number, unit] =
      /^([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(\S*)$/i.exec(plain) ?? [];
    return Object.hasOwn(units, unit) ? Number(number) * units[unit] : null;
  };
  const mix = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));
  const css = (colour) => `rgb(${colour.map(Math.round).join(" ")})`;
  // The explorer's scale of proximity, of a margin over the warning value.
  const proximity = (level) =>
    level < 1
      ? mix(colours.singular, colours.warned, level)
      : mix(colours.clear, colours.far, Math.min(1, (level - 1) / 3));

  // --- The state.
  const state = { tab: "pose", shown: { bodies: true, flags: true, margins: true, folds: false } };

  const anglesOf = (r) => {
    const flat = Math.abs(r[6]) > 1 - 1e-12;
    const yaw = flat ? Math.atan2(-r[1], r[4]) : Math.atan2(r[3], r[0]);
    const roll = flat ? 0 : Math.atan2(r[7], r[8]);
    return [yaw, Math.asin(Math.max(-1, Math.min(1, -r[6]))), roll];
  };
  const rotationOf = (angles) => {
    const [[cy, cp, cr], [sy, sp, sr]] = [angles.map(Math.cos), angles.map(Math.sin)];
    const x = [cy * cp, sy * cp, -sp];
    const y = [cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr];
    const z = [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr];
    return x.flatMap((_, i) => [x[i], y[i], z[i]]);
  };
  // Take a pose; its angles and folds may be given where they are chosen rather than found.
  const take = (pose, { angles, folds } = {}) => {
    Object.assign(state, { pose, angles: angles ?? anglesOf(pose.rotation) });
    state.folds = folds ?? toFolds(pose);
    state.joints = inverse(pose);
    state.margins = margins(pose);
    // A flat fold keeps its mode, so that legs move on in it.
    state.signs = state.margins.map(
      (value, i) => (Math.abs(value) > 1e-9 * reach && Math.sign(value)) || state.signs?.[i] || 1,
    );
    refresh();
  };
  const takeFolds = (folds) => take(fromFolds(folds), { folds });

  const values = (tab) => {
    const { position } = state.pose;
    const of = { pose: [...position, ...state.angles], joints: state.joints, folds: state.folds };
    return of[tab].map((value, i) => (HALF[TABS[tab][i]] ? value / DEGREE : value));
  };
  // The pose after one value of a tab is changed, as arguments of `take`; null if there is none.
  const poseAfter = (tab, index, value) => {
    const all = values(tab).with(index, value);
    const raw = all.map((each, i) => (HALF[TABS[tab][i]] ? each * DEGREE : each));
    if (tab === "pose") {
      const pose = { position: raw.slice(0, 3), rotation: rotationOf(raw.slice(3)) };
      return [pose, { angles: raw.slice(3) }];
    }
    const folds = tab === "folds" ? raw : forward(raw);
    if (!folds) return null;
    if (tab === "joints") state.signs.forEach((sign, i) => (folds[3 + i] *= sign));
    // Folds beyond their ranges have a pose, but that has other folds.
    const [r, beta, epsilon, ...rest] = folds;
    const largest = Math.max(beta, epsilon, ...rest.map(Math.abs));
    const isProper = Math.min(r, beta, epsilon) >= 0 && largest <= Math.PI + 1e-12;
    return [fromFolds(folds), isProper ? { folds } : {}];
  };

  const LEGEND = "Blue: all limits are kept while the other five values stay.";
  const say = (text = LEGEND) => {
    find("message").textContent = text;
  };
  // Change a value; joints go as far as the loops close.
  const change = (tab, index, given) => {
    stop();
    say();
    const most = HALF[TABS[tab][index]] ? 360 : 100 * reach;
    const value = Math.max(-most, Math.min(most, given));
    let next = poseAfter(tab, index, value);
    if (!next) {
      const name = TABS[tab][index];
      let [good, bad] = [values(tab)[index], value];
      for (let tries = 0; tries < 50; tries += 1) {
        const middle = 0.5 * (good + bad);
        if (poseAfter(tab, index, middle)) good = middle;
        else bad = middle;
      }
      const end = `${value > good ? "at most" : "at least"} ${write(good)} mm`;
      say(`With the other five as they are ${name} is ${end}: beyond it the legs do not close.`);
      next = poseAfter(tab, index, good);
    }
    if (next) take(...next);
  };

  // Go to folds along the straight line, which meets no singularity within a mode.
  let frame = 0;
  const stop = () => cancelAnimationFrame(frame);
  const glide = (target, end = () => takeFolds(target)) => {
    const arrive = () => {
      end();
      if (!scene.sees(outline())) fit();
    };
    stop();
    say();
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return arrive();
    const start = state.folds;
    const since = performance.now();
    const step = (now) => {
      const share = Math.min(1, Math.max(0, (now - since) / 900));
      if (share >= 1) return arrive();
      takeFolds(mix(start, target, share * share * (3 - 2 * share)));
      frame = requestAnimationFrame(step);
    };
    frame = requestAnimationFrame(step);
  };
  const goHome = () => glide(toFolds(design.home), () => take(design.home));
  const goToMode = (mode) => {
    const signs = mechanism.signsOf(mode);
    glide(state.folds.map((value, i) => (i < 3 ? value : signs[i - 3] * Math.abs(value))));
  };

  // --- Sliders.
  const SAMPLES = 60;
  const spanOf = (name) => {
    if (HALF[name]) return [name === "β" || name === "ε" ? 0 : -HALF[name], HALF[name]];
    return design.spans[name];
  };
  let rows = [];
  const buildSliders = () => {
    rows = TABS[state.tab].map((name, index) => {
      const [row, range, number] = ["label", "input", "input"].map((tag) =>
        document.createElement(tag),
      );
      row.textContent = `${name} (${HALF[name] ? "°" : "mm"})`;
      row.htmlFor = number.id = `value-${name}`;
      Object.assign(range, { type: "range", step: "any" });
      [range.min, range.max] = spanOf(name);
      range.setAttribute("aria-label", name);
      // A field for numbers alone would take 12,5 as 125 and 1.5 cm as 1.5.
      Object.assign(number, { type: "text", autocomplete: "off" });
      range.addEventListener("input", () => change(state.tab, index, range.valueAsNumber));
      number.addEventListener("input", () => (number.dataset.typed = ""));
      number.addEventListener("change", () => {
        delete number.dataset.typed;
        const value = read(number.value, HALF[name] ? ANGLES : LENGTHS);
        if (value !== null) change(state.tab, index, value);
        else if (number.value)
          say(
            `“${number.value}” is no ${HALF[name] ? "angle: type 12.5 or 0.2 rad" : "length: type 12.5, 12,5 or 1.2 cm"}.`,
          );
        refresh();
      });
      return { name, cells: [row, range, number] };
    });
    find("sliders").replaceChildren(...rows.flatMap(({ cells }) => cells));
  };
  // The parts of a track where all limits are kept while the other five values stay.
  const trackOf = (index, [low, high]) => {
    const stops = [];
    for (let k = 0; k < SAMPLES; k += 1) {
      const next = poseAfter(state.tab, index, low + ((k + 0.5) / SAMPLES) * (high - low));
      const keeps = next && isValid(mechanism.violations(next[0]));
      const colour = keeps ? "var(--tint)" : "transparent";
      stops.push(`${colour} ${(100 * k) / SAMPLES}% ${(100 * (k + 1)) / SAMPLES}%`);
    }
    return `linear-gradient(90deg, ${stops.join(", ")})`;
  };
  const isValid = ({ limits, collisions }) => limits.length + collisions.length === 0;
  const showSliders = () => {
    const all = values(state.tab);
    rows.forEach(({ name, cells: [, range, number] }, index) => {
      const value = all[index];
      const [low, high] = spanOf(name);
      if (range !== document.activeElement || Math.abs(range.valueAsNumber - value) > 1e-9) {
        [range.min, range.max] = [Math.min(low, value), Math.max(high, value)];
        range.value = value;
      }
      if (number.dataset.typed === undefined)
        number.value = Number(value.toFixed(HALF[name] ? 1 : decimals));
      range.setAttribute("aria-valuetext", `${write(value, 1)} ${HALF[name] ? "degrees" : "mm"}`);
      const span = [Number(range.min), Number(range.max)];
      range.style.setProperty("--marks", trackOf(index, span));
    });
  };

  // --- Answers.
  const sentenceOf = ({ index, value, above }) => {
    const { name, unit, low, high, sign } = design.limits[index];
    const factor = unit === "°" ? 1 / DEGREE : 1;
    const end = above ? high : low;
    // As many decimals as make the value differ from the end that it is beyond.
    const differs = (places) => write(factor * value, places) !== write(factor * end, places);
    let places = unit === "°" ? 1 : decimals;
    while (places < MOST_DECIMALS && !differs(places)) places += 1;
    const text = (each) => `${write(factor * each, places)}${unit === "°" ? "°" : " mm"}`;
    if (sign) {
      const wanted = above ? -1 : 1;
      return Math.sign(value) === -wanted
        ? `${name} is ${above ? "positive" : "negative"}, not ${above ? "negative" : "positive"} as at home.`
        : `${name} is ${text(value)}; its magnitude must be at least ${text(Math.abs(end))}.`;
    }
    return above
      ? `${name} is ${text(value)}, above its maximum of ${text(end)}.`
      : `${name} is ${text(value)}, below its minimum of ${text(end)}.`;
  };
  const element = (tag, text, className = "") =>
    Object.assign(document.createElement(tag), { textContent: text, className });
  const dial = (fold, colour) => {
    const angle = Math.abs(fold);
    const [x, y] = [22 * Math.cos(angle), 22 * Math.sin(angle)];
    return `<svg viewBox="-27 -24 54 28" aria-hidden="true">
      <path d="M-24 0A24 24 0 0 1 24 0Z" fill="currentColor" opacity="0.12" />
      <path d="M0 0L${x.toFixed(2)} ${(-y).toFixed(2)}" stroke="${css(colour)}" stroke-width="3" />
      <circle cx="24" r="3" fill="${css(colours.singular)}" />
      <circle cx="-24" r="3" fill="${css(colours.singular)}" /></svg>`;
  };
  const showAnswers = () => {
    const found = mechanism.violations(state.pose);
    const sizes = state.margins.map(Math.abs);
    const least = sizes.indexOf(Math.min(...sizes));
    const level = sizes[least] / design.warn;
    const [verdict, look] =
      sizes[least] <= 1e-9 * reach
        ? ["Singular pose", "beyond"]
        : level < 1
          ? ["Near a singular pose", "close"]
          : ["Clear of singularities", "within"];
    Object.assign(find("verdict"), { textContent: verdict, className: look });
    find("verdict-words").textContent =
      look === "beyond"
        ? `The platform can move although all six actuators are locked: ${MARGINS[least].words}.`
        : `The smallest margin is ${MARGINS[least].name}; it is zero with ${MARGINS[least].words}.`;
    const brief = `${MARGINS[least].name} = ${write(state.margins[least])} mm`;
    Object.assign(find("margin-brief"), { textContent: brief, className: look });
    find("margins").tBodies[0].innerHTML = MARGINS.map(({ name, fold, words }, i) => {
      const angle = state.folds[3 + i];
      return `<tr><td rowspan="2">${dial(angle, colours.margins[i])}${fold} ${write(angle / DEGREE, 1)}°</td>
        <td><b style="--colour: ${css(colours.margins[i])}">${name}</b></td>
        <td>${write(state.margins[i])}</td></tr>
        <tr><td colspan="2"><i style="--colour: ${css(proximity(sizes[i] / design.warn))}"></i> ${words}</td></tr>`;
    }).join("");

    const sentences = [
      ...found.limits.map(sentenceOf),
      ...found.collisions.map(([i, j]) => `Legs ${i + 1} and ${j + 1} collide.`),
    ];
    const ok = isValid(found);
    find("broken").replaceChildren(
      ...(ok
        ? [element("li", "All kept.", "within")]
        : sentences.map((each) => element("li", each, "beyond"))),
    );
    const count = sentences.length;
    Object.assign(find("limits-brief"), {
      textContent: ok ? "kept" : `${count} broken`,
      className: ok ? "within" : "beyond",
    });
    [...find("modes").children].forEach((button, mode) => {
      button.setAttribute("aria-pressed", mode === mechanism.modeOf(state.signs));
    });
    return found;
  };

  // --- The scene.
  const scene = window.sceneOf(find("canvas"), find("labels"), mechanism, () => request());
  const platform = [
    [...design.b1, 0],
    [design.b2, 0, 0],
    [design.b3, 0, 0],
    [0, 0, 0],
  ];
  const a3 = [...design.a3, 0];
  const cell = [1, 2, 5, 10].map((k) => k * 10 ** Math.floor(Math.log10(0.1 * reach)));
  const square = cell.findLast((each) => each <= 0.12 * reach);
  const GROUND = -0.82 * u;

  // The drawn parts of the flags' planes and lines: ends along the line, and the far side.
  const baseSpan = () => {
    const stations = [0, design.a2x, state.joints[1], state.joints[3]];
    return [Math.min(...stations) - 1.7 * u, Math.max(...stations) + 1.7 * u];
  };
  const stations = platform.map((point) => point[0]);
  const platformSpan = [Math.min(...stations) - 3.2 * u, Math.max(...stations) + 3.2 * u];
  const platformSide = design.b1[1] + Math.sign(design.b1[1]) * 1.6 * u;
  const onPlatform = (point) => mechanism.place(state.pose, point);

  const drawBodies = (found) => {
    const [low, high] = baseSpan();
    const { pose, joints } = state;
    scene.plate([[0, 0], [design.a2x, 0], a3], 0.75 * u, GROUND, -0.6 * u, colours.base);
    scene.box([low + u, -0.3 * u, -0.6 * u], [high - u, 0.3 * u, -0.42 * u], colours.rail);
    for (const x of [joints[1], joints[3]]) {
      const half = 0.42 * u;
      scene.box([x - half, -0.4 * u, -0.52 * u], [x + half, 0.4 * u, -0.2 * u], colours.carriage);
      scene.tube([x - half, 0, 0], [x + half, 0, 0], 0.28 * u, colours.joint);
    }
    for (const [x, y] of [[0, 0], a3]) {
      scene.tube([x, y, -0.6 * u], [x, y, 0], 0.2 * u, colours.joint);
      scene.ball([x, y, 0], 0.26 * u, colours.joint);
    }
    const broken = new Set(found.limits.map(({ index }) => design.limits[index].leg));
    mechanism.legs(pose).forEach(({ foot, tip }, leg) => {
      const alarm = broken.has(leg) || found.collisions.some((pair) => pair.includes(leg));
      const span = mechanism.minus(tip, foot);
      const size = mechanism.length(span) || 1;
      const end = along(foot, Math.min(0.34 * reach, 0.8 * size) / size, span);
      const radius = Math.max(0.15 * u, design.leg_radii[leg]);
      scene.tube(foot, end, radius, alarm ? colours.alarm : colours.tube);
      scene.tube(end, tip, 0.68 * radius, alarm ? colours.alarm : colours.rod);
      scene.ball(tip, 0.24 * u, colours.ball);
    });
    scene.plate(platform, 0.42 * u, -0.1 * u, 0.1 * u, colours.platform, onPlatform);
  };

  const drawFlags = () => {
    const [near1, near2, near3] = state.margins.map((value) =>
      proximity(Math.abs(value) / design.warn),
    );
    const plane = ([low, high], side, place, colour) => {
      const corners = [
        [low, 0, 0],
        [high, 0, 0],
        [high, side, 0],
        [low, side, 0],
      ].map(place);
      scene.pane(corners, [...colour, 0.2]);
      corners.forEach((corner, k) => {
        if (k > 0) scene.line(corner, corners[(k + 1) % 4], 0.03 * u, colour);
      });
      return corners;
    };
    const base = plane(baseSpan(), 1.2 * a3[1], (point) => point, near3);
    const top = plane(platformSpan, platformSide, onPlatform, near1);
    for (const [start, end] of [base, top]) scene.tube(start, end, 0.08 * u, near2);
    scene.ball([0, 0, 0], 0.36 * u, near1);
    scene.ball(state.pose.position, 0.32 * u, near3);
  };

  // A dashed line between the ends of a margin.
  const dashes = (from, to, colour) => {
    const span = mechanism.minus(to, from);
    const count = Math.max(1, Math.round(mechanism.length(span) / (0.7 * u)));
    for (let k = 0; k < count; k += 1) {
      const [start, end] = [(k + 0.2) / count, (k + 0.8) / count];
      scene.line(along(from, start, span), along(from, end, span), 0.045 * u, colour);
    }
  };
  const drawMargins = () => {
    const { position, rotation } = state.pose;
    const [x, normal] = [column(rotation, 0), column(rotation, 2)];
    // The common perpendicular of the guide and the line b2b3.
    const sine2 = x[1] * x[1] + x[2] * x[2];
    const share = sine2 > 1e-4 ? -(x[1] * position[1] + x[2] * position[2]) / sine2 : NaN;
    const meeting = along(position, share, x);
    const gaps = [
      [[0, 0, 0], normal.map((value) => -state.margins[0] * value)],
      [[meeting[0], 0, 0], meeting],
      [position, [position[0], position[1], 0]],
    ];
    gaps.forEach(([from, to], i) => {
      const middle = along(from, 0.5, mechanism.minus(to, from));
      if (!(mechanism.length(middle) < 3 * reach)) return;
      dashes(from, to, colours.margins[i]);
      for (const end of [from, to]) scene.ball(end, 0.11 * u, colours.margins[i]);
      texts.push({ text: MARGINS[i].name, at: middle, colour: css(colours.margins[i]) });
    });
  };

  // The inner leaves of the strip, and the folds as arcs at their hinges.
  const drawFolds = () => {
    const { position: p, rotation } = state.pose;
    const [r, b, , f1, , f3] = state.folds;
    const [, high] = baseSpan();
    const [x, y, n] = [0, 1, 2].map((j) => column(rotation, j));
    const far = platformSpan[Math.abs(platformSpan[0]) > Math.abs(platformSpan[1]) ? 0 : 1];
    const tip = along(p, far, x);
    const a1 = [0, 0, 0];
    scene.pane([a1, [high, 0, 0], p], [...colours.leaves[0], 0.3]);
    scene.pane([a1, p, tip], [...colours.leaves[1], 0.36]);
    for (const [from, to] of [
      [a1, p],
      [p, [high, 0, 0]],
      [tip, a1],
    ])
      scene.line(from, to, 0.03 * u, colours.leaves[1]);
    const blend = (s, v, t, w) => v.map((value, i) => s * value + t * w[i]);
    const hinge = [Math.cos(b), Math.sin(b) * Math.cos(f3), Math.sin(b) * Math.sin(f3)];
    const level = [-Math.sin(b), Math.cos(b) * Math.cos(f3), Math.cos(b) * Math.sin(f3)];
    const upward = [0, -Math.sin(f3), Math.cos(f3)];
    const [c1, s1] = [Math.cos(f1), Math.sin(f1)];
    // Each hinge: a point of it, the direction where the fold is 0, and that a right angle further.
    const hinges = [
      [along(p, 0.5 * far, x), blend(c1, y, s1, n), blend(s1, y, -c1, n)],
      [hinge.map((value) => 0.5 * r * value), level, upward.map((value) => -value)],
      [
        [0.5 * high, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
      ],
    ];
    hinges.forEach(([centre, start, further], i) => {
      const fold = state.folds[3 + i];
      const arc = Array.from({ length: 25 }, (_, k) => {
        const angle = (fold * k) / 24;
        const direction = blend(Math.cos(angle), start, Math.sin(angle), further);
        return along(centre, 0.13 * reach, direction);
      });
      const path = [centre, ...arc, centre];
      scene.pane([centre, ...arc], [...colours.margins[i], 0.22]);
      path.slice(1).forEach((end, k) => scene.line(path[k], end, 0.05 * u, colours.margins[i]));
      const text = `${MARGINS[i].fold} ${write(fold / DEGREE, 0)}°`;
      texts.push({ text, at: arc[12], colour: css(colours.margins[i]) });
    });
  };

  const theme = () => {
    const style = getComputedStyle(find("view"));
    const channels = (text) =>
      text
        .match(/[\d.]+/g)
        .slice(0, 3)
        .map((each) => Number(each) / 255);
    const dark = dot(channels(style.backgroundColor), [1, 1, 1]) < 1.5;
    return {
      background: [...channels(style.backgroundColor), 1],
      ink: dark ? [1, 1, 1, 0.22] : [0, 0, 0, 0.22],
    };
  };
  const showAxes = () => {
    const { right, up, back } = scene.axesOf();
    const names = ["x", "y", "z"];
    const ends = names.map((name, i) => ({
      name,
      i,
      depth: back[i],
      at: [32 * right[i], -32 * up[i]],
    }));
    const inks = ["#ff2060", "#18b060", "#2288f0"];
    find("axes").innerHTML = ends
      .toSorted((a, b) => a.depth - b.depth)
      .map(({ name, i, at: [x, y] }) => {
        const [tx, ty] = [1.3 * x, 1.3 * y];
        return `<g stroke="${inks[i]}" fill="${inks[i]}"><path d="M0 0L${x} ${y}" /><circle cx="${x}" cy="${y}" r="2.5" /><text x="${tx}" y="${ty}">${name}</text></g>`;
      })
      .join("");
  };

  let texts = [];
  const build = (found) => {
    scene.clear();
    const tips = platform.map(onPlatform);
    const feet = [[0, 0, 0], [design.a2x, 0, 0], a3];
    texts = [
      ...feet.map((at, k) => ({ text: `a${k + 1}`, at })),
      ...tips.map((at, k) => ({ text: `b${k + 1}`, at })),
    ];
    if (state.shown.bodies) drawBodies(found);
    scene.cast();
    if (state.shown.flags) drawFlags();
    if (state.shown.margins) drawMargins();
    if (state.shown.folds) drawFolds();
  };
  const draw = () => {
    scene.draw({ ground: GROUND - 0.01 * u, cell: square, ...theme() });
    scene.label(texts);
    showAxes();
  };
  // The corners of what is drawn.
  const outline = () => {
    const [low, high] = baseSpan();
    const base = [0, 1.2 * a3[1]].flatMap((y) => [low, high].map((x) => [x, y, GROUND]));
    const top = [0, platformSide].flatMap((y) => platformSpan.map((x) => onPlatform([x, y, 0])));
    return [...base, a3, ...top];
  };
  const fit = () => scene.fit(outline());

  // Everything is shown once in a frame of the browser, however often it changes.
  let [pending, stale] = [0, false];
  const request = (everything = false) => {
    stale ||= everything;
    pending ||= requestAnimationFrame(() => {
      pending = 0;
      if (stale) {
        build(showAnswers());
        showSliders();
      }
      stale = false;
      draw();
    });
  };
  const refresh = () => request(true);

  // --- The start.
  const openTab = (tab) => {
    state.tab = tab;
    // Each fold has the sign of its margin: one of both is enough to see.
    setShown("folds", tab === "folds");
    setShown("margins", tab !== "folds");
    say();
    buildSliders();
    refresh();
  };
  const setShown = (name, on) => {
    state.shown[name] = on;
    find(`show-${name}`).checked = on;
    refresh();
  };
  const names = { bodies: "Legs", flags: "Flags", margins: "Margins", folds: "Folds" };
  find("shown").replaceChildren(
    ...Object.entries(names).map(([name, words]) => {
      const [label, box] = [element("label", ""), element("input", "")];
      Object.assign(box, { type: "checkbox", id: `show-${name}`, checked: state.shown[name] });
      box.addEventListener("change", () => setShown(name, box.checked));
      label.append(box, element("span", words));
      return label;
    }),
  );
  find("modes").replaceChildren(
    ...Array.from({ length: 8 }, (_, mode) => {
      const signs = mechanism.signsOf(mode).map((sign) => (sign > 0 ? "+" : "−"));
      const button = element("button", "");
      button.type = "button";
      button.append(element("b", `mode ${mode}`), signs.join(" "));
      button.addEventListener("click", () => goToMode(mode));
      return button;
    }),
  );
  find("limits").tBodies[0].replaceChildren(
    ...[...design.limits, ...design.clearances]
      .filter(({ words }) => words)
      .map(({ name, words }) => {
        const row = element("tr", "");
        row.append(element("td", name), element("td", words));
        return row;
      }),
  );
  find("tabs").addEventListener("change", (event) => openTab(event.target.value));
  find("home").addEventListener("click", goHome);
  find("fit").addEventListener("click", fit);
  find("canvas").addEventListener("dblclick", fit);
  find("canvas").addEventListener("keydown", ({ key, code }) => {
    // A key that writes no Latin letter goes by its place.
    if (/^f$/i.test(key) || (code === "KeyF" && !/\p{Script=Latin}/u.test(key))) fit();
  });
  find("all").open = window.innerWidth >= 1100;
  find("scale").textContent = scene.isReady
    ? `1 square = ${square} mm`
    : "This browser has no WebGL 2, so the scene shows labels alone; the numbers hold.";
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => request());
  find("name").textContent = design.name;
  document.title = `${design.name} – flagged 4-4 manipulator`;
  // What the explorer shows of the mechanism is shown here too, if there is the like.
  const view = link.view ?? {};
  const tab = { lengths: "joints", folds: "folds" }[view.coordinates] ?? "pose";
  find("tabs").querySelector(`[value=${tab}]`).checked = true;
  openTab(tab);
  setShown("bodies", view.bodies !== false || view.legs !== false);
  setShown("flags", view.flags !== false);
  if (view.leaves) setShown("folds", true);
  if (view.tetrahedra && !view.tetrahedra.some(Boolean)) setShown("margins", false);
  take(link.pose ? design.poseOf(link.pose) : design.home);
  if (link.towards) scene.lookFrom(link.towards);
  let framed = false;
  new ResizeObserver(() => {
    if (!framed) fit();
    framed = true;
    request();
  }).observe(find("view"));
  return { ...mechanism, state, scene, take, change, goToMode };
};
