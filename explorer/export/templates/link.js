// What a page begins with: the design, the pose and the view of a link, or those of the page's own.

// The value in the fragment of an address, see `explorer.files.fragments`; an error says in words why
// there is none.
window.readFragment = async (fragment, newest) => {
  const [, head, schema, packed, sum] =
    /^((\d{1,3})\.([\w-]+))\.([0-9a-f]{8})$/.exec(fragment) ?? [];
  let crc = -1;
  for (const letter of head ?? "") {
    crc ^= letter.charCodeAt(0);
    for (let bit = 0; bit < 8; bit += 1) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  if (!head || (~crc >>> 0).toString(16).padStart(8, "0") !== sum)
    throw new Error(
      "The link is damaged: letters of it are missing or changed; copy the whole of it again.",
    );
  if (Number(schema) < 1 || Number(schema) > newest)
    throw new Error(
      `The link has schema ${schema}, of another version of the explorer; this page reads schemas up to ${newest}.`,
    );
  const letters = atob(packed.replaceAll("-", "+").replaceAll("_", "/"));
  const bytes = new Blob([Uint8Array.from(letters, (letter) => letter.charCodeAt(0))]);
  const inflated = bytes.stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(inflated).json();
};

// A design in millimetres and radians: its fields as its file has them, without those that have their
// default, and its home pose. What all designs have in common comes with the page.
window.designOf = ({ design: given, home }, { defaults, ...common }) => {
  const PLACES = { maximumFractionDigits: 20 };
  const all = { ...defaults, ...given };
  const limits = { ...defaults.limits, ...given.limits };
  const unit = all.unit_mm;
  const scale = (value) => (Array.isArray(value) ? value.map(scale) : unit * value);
  const [b2, b3] = [all.b2, all.b3];
  const reach = Math.hypot(...all.a3);
  const tolerance = common.tolerance * reach;
  const poseOf = ({ position, quaternion }) => ({
    position: scale(position),
    rotation: window.rotationOf(quaternion),
  });
  const atHome = poseOf(all.home ?? home);
  const { rotation } = atHome;
  const ends = limits.guide ?? [0, reach];
  const LENGTHS = ["l1", "d2", "d4", "l4"];
  const lengths = LENGTHS.map((name) => {
    const [low, high] = limits[name] ?? [0, null];
    return [low, high ?? reach];
  });
  const page = {
    ...common,
    name: all.name,
    a3: scale(all.a3),
    b1: scale(all.b1),
    b2: unit * b2,
    b3: unit * b3,
    a2x: unit * (ends[1] || ends[0] || reach),
    reach: unit * reach,
    warn: common.warn * unit * reach,
    leg_radii: scale(limits.leg_radii),
    home: atHome,
    poseOf,
  };
  const mechanism = window.flagged44(page);
  const { pairs } = mechanism;

  // A number for people, with so many digits at least, and all of a whole number.
  const number = (value, digits = common.digits) => {
    const [mantissa, power] = value
      .toExponential(digits - 1)
      .split("e")
      .map(Number);
    const isPlain = !value || (power >= -4 && power < 9);
    const places = Math.max(0, digits - 1 - power);
    const text = isPlain ? Number(value.toFixed(places)).toLocaleString("en", PLACES) : mantissa;
    return `${text}${isPlain ? "" : ` × 10^${power}`}`.replaceAll("-", "−");
  };
  const rows = common.limits.map((row) => ({ ...row, low: -Infinity, high: Infinity, words: "" }));
  const demand = (index, low, high, words) =>
    Object.assign(rows[index], {
      low: unit * (low - tolerance),
      high: unit * (high + tolerance),
      words,
    });
  const between = (index, [low, high], note = "", least = -Infinity) => {
    const most = `${number(unit * high)}${note}`;
    demand(index, low, high, low > least ? `${number(unit * low)} to ${most}` : `at most ${most}`);
  };
  const sign = (index, wanted, least = 0) => {
    const size = least ? `, magnitude at least ${number(unit * least)}` : "";
    const range = wanted > 0 ? [least, Infinity] : [-Infinity, -least];
    demand(index, ...range, `sign as at home${size}`);
  };
  const { box, guide, gap, margin, swing, leg_radii: radii } = limits;
  for (const axis of box ? [0, 1, 2] : []) between(axis, [box[0][axis], box[1][axis]]);
  const signs = mechanism.margins(page.home).map((value) => (value > 0 ? 1 : -1));
  if (margin !== null) signs.forEach((wanted, k) => sign(3 + k, wanted, margin));
  if (guide) for (const index of [6, 7]) between(index, guide);
  if (gap) demand(8, gap, Infinity, `at least ${number(unit * gap)}`);
  const difference = (b3 - b2) * rotation[0];
  if (limits.carriage_order === "home" && Math.abs(difference) > tolerance)
    sign(9, Math.sign(difference));
  LENGTHS.forEach((name, k) => {
    const isReach = (limits[name]?.[1] ?? null) === null;
    between(10 + k, lengths[k], isReach ? " (the reach)" : "", 0);
  });
  const legs = mechanism.legs(page.home).map(({ foot, tip }) => mechanism.minus(tip, foot));
  page.axes = ["a1", "a3", "b1", "b2", "b3", "b4"].map((joint, k) => {
    const most = swing?.[joint] ?? null;
    const leg = legs[rows[14 + k].leg];
    const size = mechanism.length(leg);
    if (most === null) return [0, 0, 0];
    // A leg without a direction at home can have no angle from it.
    const high = size ? (most * Math.PI) / 180 + common.tolerance : -Infinity;
    Object.assign(rows[14 + k], { high, words: `at most ${number(most)}°` });
    const axis = leg.map((value) => value / (size || 1));
    const columns = [0, 1, 2].map((j) => mechanism.column(rotation, j));
    return k < 2 ? axis : columns.map((each) => mechanism.dot(each, axis));
  });
  page.limits = rows;
  // A pair that shares a joint may touch.
  const least = 1e-12 * Math.max(...[...all.a3, ...all.b1, b2, b3].map(Math.abs));
  const distances = pairs.map(([i, j]) => {
    const isJoined =
      j === 3 && ((i === 1 && Math.abs(b2) <= least) || (i === 2 && Math.abs(b3) <= least));
    return isJoined ? -1 : radii[i] + radii[j];
  });
  page.radii = scale(distances);
  page.clearances = pairs.map(([i, j], k) => {
    const apart = distances[k] ? `more than ${number(page.radii[k], 4)} apart` : "do not touch";
    return { name: `Legs ${i + 1}–${j + 1}`, words: distances[k] < 0 ? "" : apart };
  });
  page.spans = window.spansOf(all, { ...limits, lengths, margin }, atHome.position[2] > 0, scale);
  return page;
};

// The rotation, row by row, of a unit quaternion (w, x, y, z).
window.rotationOf = ([w, x, y, z]) => [
  1 - 2 * (y * y + z * z),
  2 * (x * y - w * z),
  2 * (x * z + w * y),
  2 * (x * y + w * z),
  1 - 2 * (x * x + z * z),
  2 * (y * z - w * x),
  2 * (x * z - w * y),
  2 * (y * z + w * x),
  1 - 2 * (x * x + y * y),
];

// The ranges of sliders: what the limits allow in any orientation, as
// `explorer.mechanism.feasible_intervals` bounds it, and a tenth more at either end.
window.spansOf = ({ a3, b1, b2, b3 }, { lengths, guide, box, margin }, isAbove, scale) => {
  const [low, high] = [0, 1].map((end) => lengths.map((range) => range[end]));
  const [r1, r2, r3] = [Math.hypot(...b1), Math.abs(b2), Math.abs(b3)];
  const within = (...ranges) => [
    Math.max(...ranges.map((range) => range[0])),
    Math.min(...ranges.map((range) => range[1])),
  ];
  const about = (centre, radius) => [centre - radius, centre + radius];
  const along = (axis) => (box ? [box[0][axis], box[1][axis]] : [-Infinity, Infinity]);
  const farthest = (range, point = 0) => Math.max(...range.map((end) => Math.abs(end - point)));
  const [first, last] = guide ?? [-Infinity, Infinity];
  const aboutA1 = high[0] + r1;
  const across = Math.min(aboutA1, high[1] + r2, high[2] + r3);
  const ofGuide = [r2, r3].map((radius) => [first - radius, last + radius]);
  const x = within(about(0, aboutA1), about(a3[0], high[3]), ...ofGuide, along(0));
  const y = within(about(0, across), about(a3[1], high[3]), along(1));
  const side = isAbove ? [margin, Infinity] : [-Infinity, -margin];
  const z = within(
    about(0, Math.min(across, high[3])),
    margin === null ? [-Infinity, Infinity] : side,
    along(2),
  );
  const far = [x, y, z].map((range) => farthest(range));
  const fromA1 = Math.min(Math.hypot(...far), aboutA1);
  const fromAxis = Math.hypot(far[1], far[2]);
  const [d1, d3] = [b2, b3].map((b) =>
    within(
      [x[0] - Math.abs(b), x[1] + Math.abs(b)],
      about(0, high[0] + Math.hypot(b1[0] - b, b1[1])),
      [first, last],
    ),
  );
  const fromA3 = Math.hypot(farthest(x, a3[0]), farthest(y, a3[1]), far[2]);
  const length = (leg, most) => [low[leg], Math.min(high[leg], most)];
  const spans = { x, y, z, d1, d3, r: [0, Math.hypot(...far)] };
  Object.assign(spans, { l1: length(0, fromA1 + r1), d2: length(1, fromAxis + r2) });
  Object.assign(spans, { d4: length(2, fromAxis + r3), l4: length(3, fromA3) });
  return Object.fromEntries(
    Object.entries(spans).map(([name, span]) => {
      // Limits that contradict each other leave a range whose ends are reversed.
      const [least, most] = span.toSorted((a, b) => a - b);
      const more = 0.1 * (most - least);
      return [name, scale([least - more, most + more])];
    }),
  );
};

// Starts the page with the design of a link, or of the preset that the fragment names; with its own
// design if there is no fragment, or no usable one.
window.openPage = async ({ own, presets, schema, common }, fragment) => {
  addEventListener("hashchange", () => location.reload());
  try {
    const link = !fragment
      ? own
      : Object.hasOwn(presets, fragment)
        ? presets[fragment]
        : await window.readFragment(fragment, schema);
    window.page = window.startPage(window.designOf(link, common), link);
  } catch (error) {
    window.page = window.startPage(window.designOf(own, common), own);
    const words = document.createElement("b");
    Object.assign(words, { className: "beyond", textContent: error.message });
    document.getElementById("message").replaceChildren(words);
  }
};
