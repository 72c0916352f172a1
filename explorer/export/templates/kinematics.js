// Kinematics of one design of the flagged 4-4 manipulator, in millimetres and radians. A pose is
// { position: [x, y, z], rotation: nine numbers row by row }, of b4 and from platform to base.
// Joints are (l1, d1, d2, d3, d4, l4), folds (r, β, ε, φ1, φ2, φ3).
window.flagged44 = (design) => {
  const [a3x, a3y] = design.a3;
  const [b1x, b1y] = design.b1;
  const { b2, b3 } = design;
  const size = Math.max(...[a3x, a3y, b1x, b1y, b2, b3].map(Math.abs));
  // Relative rounding of one operation, and the error bounds below zero that count as zero.
  const [EPSILON, ROUNDINGS] = [2 ** -52, 8];
  const pairs = [0, 1, 2].flatMap((i) => [1, 2, 3].filter((j) => j > i).map((j) => [i, j]));

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const along = (a, share, b) => a.map((value, i) => value + share * b[i]);
  const minus = (a, b) => along(a, -1, b);
  const length = (a) => Math.sqrt(dot(a, a));
  const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1],
    a[2] * b[0] - a[0] * b[2],
    a[0] * b[1] - a[1] * b[0],
  ];
  const column = (rotation, j) => [rotation[j], rotation[3 + j], rotation[6 + j]];
  const turn = (rotation, a) => [0, 3, 6].map((row) => dot(rotation.slice(row, row + 3), a));
  const place = ({ position, rotation }, point) => along(turn(rotation, point), 1, position);

  // The ends of the four legs: a1, the carriages and a3 below, b1, b2, b3 and b4 above.
  const legs = (pose) => {
    const [x, y] = [column(pose.rotation, 0), column(pose.rotation, 1)];
    const tip1 = along(along(pose.position, b1x, x), b1y, y);
    const tip2 = along(pose.position, b2, x);
    const tip3 = along(pose.position, b3, x);
    const feet = [
      [0, 0, 0],
      [tip2[0], 0, 0],
      [tip3[0], 0, 0],
      [a3x, a3y, 0],
    ];
    return feet.map((foot, i) => ({ foot, tip: [tip1, tip2, tip3, pose.position][i] }));
  };

  const inverse = (pose) => {
    const ends = legs(pose);
    const [l1, d2, d4, l4] = ends.map(({ foot, tip }) => length(minus(tip, foot)));
    return [l1, ends[1].foot[0], d2, ends[2].foot[0], d4, l4];
  };

  const margins = ({ position: p, rotation: r }) => [
    -dot(column(r, 2), p),
    r[3] * p[2] - r[6] * p[1],
    p[2],
  ];

  // p = X(φ3) Z(β) (r, 0, 0) and R = X(φ3) Z(β) X(−φ2) Z(ε) X(−φ1).
  const fromFolds = ([r, ...angles]) => {
    const [cb, ce, c1, c2, c3] = angles.map(Math.cos);
    const [sb, se, s1, s2, s3] = angles.map(Math.sin);
    const columns = [
      [ce, se * c2, -se * s2],
      [-se * c1, ce * c1 * c2 - s1 * s2, -ce * c1 * s2 - s1 * c2],
      [-se * s1, ce * s1 * c2 + c1 * s2, c1 * c2 - ce * s1 * s2],
    ].map(([x, y, z]) => {
      const [u, v] = [cb * x - sb * y, sb * x + cb * y];
      return [u, c3 * v - s3 * z, s3 * v + c3 * z];
    });
    const rotation = [0, 1, 2].flatMap((row) => columns.map((each) => each[row]));
    return { position: [r * cb, r * sb * c3, r * sb * s3], rotation };
  };

  const toFolds = ({ position, rotation }) => {
    // A negative zero would turn a fold of π into −π.
    const [px, py, pz] = [position[0], position[1], position[2] + 0];
    const h = Math.sqrt(py * py + pz * pz);
    const r = Math.sqrt(px * px + h * h);
    const [c3, s3] = h > 0 ? [py / h, pz / h] : [1, 0];
    const [cb, sb] = r > 0 ? [px / r, h / r] : [1, 0];
    // The platform's axes, turned back by X(φ3) Z(β).
    const [u, v, n] = [0, 1, 2].map((j) => {
      const [x, y, z] = column(rotation, j);
      const level = c3 * y + s3 * z;
      return [cb * x + sb * level, cb * level - sb * x, c3 * z - s3 * y];
    });
    const se = Math.sqrt(u[1] * u[1] + u[2] * u[2]);
    const [c2, s2] = se > 0 ? [u[1] / se, (0 - u[2]) / se] : [1, 0];
    const angles = [
      [sb, cb],
      [se, u[0]],
      [0 - (s2 * v[1] + c2 * v[2]), s2 * n[1] + c2 * n[2]],
      [s2, c2],
      [s3, c3],
    ].map(([sine, cosine]) => Math.atan2(sine, cosine));
    // Just above −π, a fold may be rounded to it.
    return [r, ...angles.map((angle) => (angle > -Math.PI ? angle : Math.PI))];
  };

  // The folds of joints, with φ1, φ2 and φ3 from 0 to π: their signs are those of the mode. Null
  // if the joints do not close. Each operation is Python's, so that flat folds are the same too.
  const forward = (joints) => {
    const [l1, d1, d2, d3, d4, l4] = joints;
    const { abs, sqrt, max } = Math;
    const clamp = (value) => max(-1, Math.min(1, value));
    const sineOf = (cosine) => sqrt((1 - cosine) * (1 + cosine));
    // c is the cosine between the guide and the line b2b3, h the distance of b4 from the guide. The
    // squared margins are g² − v², (1 − c²) h² − lean² and h² − py², with the parts u and v of
    // the vector from a1 to b4 on the platform's axes. Bounds of rounding begin with e.
    const span = b3 - b2;
    const ends = abs(b3) + abs(b2);
    const stretch = 1 + ends / abs(span);
    let c = (d3 - d1) / span;
    const ec = (EPSILON * (abs(d3) + abs(d1) + abs(c) * ends)) / abs(span);
    const sine2 = (1 - c) * (1 + c);
    const eSine = 2 * abs(c) * ec + EPSILON * abs(sine2);
    const px = d1 - b2 * c;
    const epx = abs(b2) * ec + EPSILON * (abs(d1) + abs(b2 * c));
    const t = -b2 / span;
    const pull = t * (1 - t) * span * span;
    const h2 = (1 - t) * d2 * d2 + t * d4 * d4 - pull * sine2;
    const h2Terms = abs(1 - t) * d2 * d2 + abs(t) * d4 * d4 + abs(pull * sine2);
    const eh = abs(pull) * eSine + EPSILON * h2Terms * stretch;
    const lean = (d4 * d4 - d2 * d2 - (b3 + b2) * span * sine2) / (2 * span);
    const leanTerms = (d4 * d4 + d2 * d2) / (2 * abs(span)) + abs(lean) * stretch;
    const eLean = 0.5 * abs(b3 + b2) * eSine + EPSILON * leanTerms;
    const u = c * px + lean;
    const eu = abs(px) * ec + abs(c) * epx + eLean;
    const r2 = px * px + h2;
    const er = 2 * abs(px) * epx + eh + EPSILON * px * px;
    const side = px - a3x;
    const py = (side * side + h2 + a3y * a3y - l4 * l4) / (2 * a3y);
    const pyTerms = side * side + abs(h2) + a3y * a3y + l4 * l4;
    const epy = (2 * abs(side) * epx + eh + EPSILON * pyTerms) / (2 * abs(a3y));
    const b1Square = b1x * b1x + b1y * b1y;
    const v = (l1 * l1 - r2 - b1Square - 2 * b1x * u) / (2 * b1y);
    const vTerms = l1 * l1 + abs(r2) + b1Square;
    const ev = (er + 2 * abs(b1x) * eu + EPSILON * vTerms) / (2 * abs(b1y));
    const errorOf = (value, error) => (2 * abs(value) + error) * error;
    const squares = [r2 - u * u - v * v, sine2 * h2 - lean * lean, h2 - py * py];
    const errors = [er + errorOf(u, eu) + errorOf(v, ev), 0, eh + errorOf(py, epy)];
    errors[1] = abs(sine2) * eh + abs(h2) * eSine + errorOf(lean, eLean);
    if (sine2 < 0 || h2 < 0) {
      // Their product may be positive. The sine is made a length by the largest one.
      const largest = max(size, ...joints.map(abs));
      squares[1] = Math.min(squares[1], largest * largest * sine2, h2);
      errors[1] += largest * largest * eSine + eh;
    }
    const closes = squares.every((value, i) => value >= -ROUNDINGS * errors[i]);
    if (!closes || Math.min(l1, d2, d4, l4) < 0) return null;
    // Where a cosine is beyond 1 the fold is flat.
    c = clamp(c);
    const h = sqrt(max(0, h2));
    const r = sqrt(px * px + h * h);
    const [cb, sb] = r > 0 ? [px / r, h / r] : [1, 0];
    let ce = r > 0 ? clamp(u / r) : c;
    let se = sineOf(ce);
    let c2 = sb * se > 0 ? (cb * ce - c) / (sb * se) : 1;
    if (abs(c2) >= 1) {
      // The lines are in one plane, so ε follows from β and the angle between them.
      c2 = Math.sign(c2);
      const sine = sb * ce + c2 * cb * se < 0 ? -sineOf(c) : sineOf(c);
      ce = cb * c + sb * sine;
      se = c2 * (cb * sine - sb * c);
    }
    const c1 = r * se > 0 ? clamp(-v / (r * se)) : 1;
    const c3 = h > 0 ? clamp(py / h) : 1;
    const folds = [c1, c2, c3].map((cosine) => Math.atan2(sineOf(cosine), cosine));
    return [r, Math.atan2(sb, cb), Math.atan2(se, ce), ...folds];
  };

  // Bit 2 is set if δ1 is positive, bit 1 if δ2 is, bit 0 if δ3 is.
  const modeOf = (signs) => signs.reduce((mode, sign) => 2 * mode + (sign > 0 ? 1 : 0), 0);
  const signsOf = (mode) => [4, 2, 1].map((bit) => (mode & bit ? 1 : -1));

  // The squared distance of the axes of two legs.
  const squareBetween = (first, second) => {
    const [u, v] = [first, second].map(({ foot, tip }) => minus(tip, foot));
    const w = minus(first.foot, second.foot);
    const share = (value, over) => (value <= 0 || over <= 0 ? 0 : Math.min(1, value / over));
    const [uu, vv, uv, ur, vr] = [dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)];
    const ends = [
      [0, share(vr, vv)],
      [1, share(uv + vr, vv)],
      [share(-ur, uu), 0],
      [share(uv - ur, uu), 1],
    ];
    const n = cross(u, v);
    const [nn, s, t] = [dot(n, n), dot(n, cross(v, w)), dot(n, cross(u, w))];
    if (s > 0 && s < nn && t > 0 && t < nn) ends.push([s / nn, share(uv * (s / nn) + vr, vv)]);
    return Math.min(
      ...ends.map(([p, q]) => along(along(w, p, u), -q, v)).map((gap) => dot(gap, gap)),
    );
  };

  // The quantities that limits bound, in the order of `design.limits`: b4, the margins, d1, d3,
  // |d1 − d3|, d3 − d1, l1, d2, d4, l4, and the angles of legs from home at a1, a3, b1 to b4.
  const quantities = (pose) => {
    const [l1, d1, d2, d3, d4, l4] = inverse(pose);
    const ends = legs(pose);
    const swings = [0, 3, 0, 1, 2, 3].map((leg, k) => {
      const axis = k < 2 ? design.axes[k] : turn(pose.rotation, design.axes[k]);
      const arm = minus(ends[leg].tip, ends[leg].foot);
      return Math.atan2(length(cross(arm, axis)), dot(arm, axis));
    });
    const joints = [d1, d3, Math.abs(d3 - d1), d3 - d1, l1, d2, d4, l4];
    return [...pose.position, ...margins(pose), ...joints, ...swings];
  };

  // The broken limits of a pose: { index, value, above } of quantities, and the pairs of legs that
  // collide.
  const violations = (pose) => {
    const limits = [];
    quantities(pose).forEach((value, index) => {
      const { low, high } = design.limits[index];
      if (!(low <= value && value <= high)) limits.push({ index, value, above: value > high });
    });
    const ends = legs(pose);
    const collisions = pairs.filter(([i, j], k) => {
      const radius = design.radii[k];
      return radius >= 0 && !(squareBetween(ends[i], ends[j]) > radius * radius);
    });
    return { limits, collisions };
  };

  const vectors = { dot, along, minus, length, cross, column, turn };
  const modes = { modeOf, signsOf, pairs };
  const poses = { place, legs, inverse, margins, fromFolds, toFolds, forward };
  return { ...vectors, ...modes, ...poses, quantities, violations };
};
