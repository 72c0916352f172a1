// Reads the map of a slice under the pointer: coordinates, the measure that colours it, and what
// is there; a click goes there, as a press of "workspace.go".
window.explorer.map ??= (() => {
  const AXES = ["x", "y", "z"],
    // Share of the distance from a1 up to which a margin is zero.
    SINGULAR = 1e-13,
    // Signs of six errors, but for a common one.
    CORNERS = 32,
    HINT = "Point at the map to read it, click to go there.";
  const dot = (a, b) => a.reduce((sum, value, k) => sum + value * b[k], 0);
  const plus = (a, b) => a.map((value, k) => value + b[k]);
  const unit = (a) => {
    const length = Math.hypot(...a);
    return length ? a.map((value) => value / length) : [0, 0, 0];
  };
  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

  // The smallest |δ| at a position and its number: margins are linear, and zero at a1.
  const leastMargin = ({ gradients }, p) => {
    const sizes = gradients.map((gradient) => Math.abs(dot(gradient, p)));
    const least = Math.min(...sizes);
    return { least, number: sizes.indexOf(least) + 1 };
  };

  // The actuator Jacobian, made homogeneous with the reach; a row for each of l1, d1 to d4, l4.
  const jacobian = ({ arms: [b1, b2, b3], a3, reach }, p) => {
    const radial = (arm) => unit([0, p[1] + arm[1], p[2] + arm[2]]);
    const rows = [
      [unit(plus(p, b1)), b1],
      [[1, 0, 0], b2],
      [radial(b2), b2],
      [[1, 0, 0], b3],
      [radial(b3), b3],
      [unit(p.map((value, k) => value - a3[k])), [0, 0, 0]],
    ];
    return rows.map(([along, arm]) =>
      along.concat(cross(arm, along).map((moment) => moment / reach)),
    );
  };

  // Smallest over largest singular value of a matrix, by Jacobi's one-sided rotations of its rows.
  const inverseCondition = (matrix) => {
    const rows = matrix.map((row) => [...row]);
    for (let sweep = 0; sweep < 30; sweep += 1) {
      let off = 0;
      for (let i = 0; i < rows.length; i += 1) {
        for (let j = i + 1; j < rows.length; j += 1) {
          const [a, b] = [rows[i], rows[j]];
          const [aa, bb, ab] = [dot(a, a), dot(b, b), dot(a, b)];
          if (Math.abs(ab) <= 1e-15 * Math.sqrt(aa * bb)) continue;
          off = Math.max(off, Math.abs(ab));
          const zeta = (bb - aa) / (2 * ab);
          const t = (zeta < 0 ? -1 : 1) / (Math.abs(zeta) + Math.hypot(1, zeta));
          const c = 1 / Math.hypot(1, t),
            s = c * t;
          rows[i] = a.map((value, k) => c * value - s * b[k]);
          rows[j] = a.map((value, k) => s * value + c * b[k]);
        }
      }
      if (!off) break;
    }
    const lengths = rows.map((row) => Math.hypot(...row));
    const largest = Math.max(...lengths);
    return largest ? Math.min(...lengths) / largest : 0;
  };

  // The forces of the actuators that hold each of several loads (F; M about b4): the rows of the
  // Jacobian times these forces add up to minus the load. By elimination with pivots.
  const holdingForces = (facts, p, loads) => {
    const rows = jacobian(facts, p);
    const table = rows.map((_, k) =>
      rows.map((row) => row[k]).concat(loads.map((load) => -load[k] / (k < 3 ? 1 : facts.reach))),
    );
    for (let k = 0; k < table.length; k += 1) {
      let pivot = k;
      for (let i = k; i < table.length; i += 1) {
        if (Math.abs(table[i][k]) > Math.abs(table[pivot][k])) pivot = i;
      }
      [table[k], table[pivot]] = [table[pivot], table[k]];
      for (let i = 0; i < table.length; i += 1) {
        if (i === k) continue;
        const factor = table[i][k] / table[k][k];
        table[i] = table[i].map((value, j) => value - factor * table[k][j]);
      }
    }
    return table.map((row, k) => row.slice(table.length).map((value) => value / row[k]));
  };

  const isSingular = (facts, p) => leastMargin(facts, p).least <= SINGULAR * Math.hypot(...p);
  // The loads (F; M about b4) of a unit force at the tool along each axis. The forces that hold
  // them are minus how far a unit of each actuator moves the tool along that axis.
  const unitLoads = ({ tool }) =>
    AXES.map((_, axis) => {
      const force = AXES.map((__, k) => (k === axis ? 1 : 0));
      return force.concat(cross(tool, force));
    });
  const strutLength = (p, arm) => Math.hypot(p[1] + arm[1], p[2] + arm[2]);

  // The largest share of a limit that the load uses at a position, and the part of the machine; see
  // statics/held.py. It is infinite on a singular plane.
  const largestShare = (facts, p) => {
    const { wrench, anyForce, overLimits, parts } = facts.load;
    if (isSingular(facts, p)) return { value: Infinity, part: "" };
    const loads = [wrench, ...unitLoads(facts)];
    const forces = holdingForces(facts, p, loads).map(([value, ...rates]) => ({
      value,
      spread: anyForce * Math.hypot(...rates),
    }));
    const bending = ({ value, spread }, arm) => {
      const length = strutLength(p, arm);
      return { value: value * length, spread: spread * length };
    };
    const [, b2, b3] = facts.arms;
    const loaded = [
      ...forces,
      bending(forces[1], b2),
      bending(forces[3], b3),
      forces[2],
      forces[4],
    ];
    const shares = loaded.map(({ value, spread }, k) =>
      Math.max((spread + value) * overLimits[0][k], (spread - value) * overLimits[1][k]),
    );
    const share = Math.max(0, ...shares);
    return { value: share, part: share ? parts[shares.indexOf(share)] : "" };
  };

  // The largest displacement of the tool by errors of the actuators of any signs; see
  // statics/accuracy.py. It is infinite on a singular plane.
  const worstError = (facts, p) => {
    if (isSingular(facts, p)) return Infinity;
    const moves = holdingForces(facts, p, unitLoads(facts)).map((rates, i) =>
      rates.map((rate) => rate * facts.errors[i]),
    );
    let largest = 0;
    for (let corner = 0; corner < CORNERS; corner += 1) {
      const signed = moves.map((move, i) => ((corner >> i) & 1 ? move.map((d) => -d) : move));
      largest = Math.max(largest, Math.hypot(...signed.reduce(plus)));
    }
    return largest;
  };

  // The displacement of the tool under the load; see statics/compliance.py. It is infinite on a
  // singular plane.
  const deflection = (facts, p) => {
    if (isSingular(facts, p)) return Infinity;
    const { wrench, actuators, struts } = facts.giving;
    const [, b2, b3] = facts.arms;
    const softness = [...actuators];
    softness[1] += struts[0] * strutLength(p, b2) ** 3;
    softness[3] += struts[1] * strutLength(p, b3) ** 3;
    const moves = holdingForces(facts, p, [wrench, ...unitLoads(facts)]).map(
      ([force, ...rates], i) => rates.map((rate) => rate * softness[i] * force),
    );
    return Math.hypot(...moves.reduce(plus));
  };

  const number = (value, decimals) =>
    value
      .toLocaleString("en", {
        minimumFractionDigits: decimals,
        maximumFractionDigits: decimals,
        signDisplay: "negative",
      })
      .replace("-", "\u2212");
  // What a measure in words is at a position, and the part of the machine that has it.
  const amount = (facts, p) => {
    if (facts.load) return largestShare(facts, p);
    return { value: facts.errors ? worstError(facts, p) : deflection(facts, p), part: "" };
  };
  // The measures are those of b4, from which the point of the map is at an offset.
  const measure = (facts, point) => {
    const p = facts.offset ? point.map((value, k) => value - facts.offset[k]) : point;
    if (facts.words) {
      const { name, unit: unitName, factor } = facts.words;
      const { value, part } = amount(facts, p);
      const text = Number.isFinite(value)
        ? (factor * value).toLocaleString("en", { maximumSignificantDigits: 3 })
        : "\u221e";
      return `${name} ${text} ${unitName}${part && ` (${part})`}`;
    }
    if (facts.arms) {
      const value = inverseCondition(jacobian(facts, p));
      return `1 / cond J ${number(value, 5)}`;
    }
    const { least, number: which } = leastMargin(facts, p);
    return `min |δ| ${number(least, facts.decimals)} (δ${which})`;
  };

  const factsOf = (map) => JSON.parse(map.dataset.map);
  // The position in the base's frame under an event on a map; null beside its frame.
  const positionAt = (map, facts, { clientX, clientY }) => {
    const matrix = map.getScreenCTM();
    if (!matrix) return null;
    const at = new DOMPoint(clientX, clientY).matrixTransform(matrix.inverse());
    const [left, bottom, scale] = facts.place;
    const inPlane = [
      facts.lows[0] + (at.x - left) / scale,
      facts.lows[1] + (bottom - at.y) / scale,
    ];
    if (inPlane.some((value, k) => value < facts.lows[k] || value > facts.highs[k])) return null;
    const p = [...inPlane];
    p.splice(facts.axis, 0, facts.level);
    return p;
  };
  const place = (facts, target) => {
    if (target.classList?.contains("is-colliding")) return ", legs collide";
    if (target.classList?.contains("is-blocked")) return `, ${facts.leftOut}`;
    return target.closest("[data-within]") ? "" : ", beyond the limits";
  };
  const read = (map, event) => {
    const facts = factsOf(map),
      p = positionAt(map, facts, event);
    if (!p) return HINT;
    const axes = [0, 1, 2].filter((k) => k !== facts.axis);
    const words = axes.map((k) => `${AXES[k]} ${number(p[k], facts.decimals)}`).join(", ");
    return `${words} units: ${measure(facts, p)}${place(facts, event.target)}`;
  };
  const mapAt = (target) => target.closest?.("[data-map]") ?? null;
  const readingOf = (map) => map.parentElement?.querySelector(".ex-reading");
  // The last pointer over a map: its words follow the map.
  let last = null;
  const show = () => {
    if (!last) return;
    const map = mapAt(last.target) ?? null;
    const reading = map && readingOf(map);
    const words = reading && read(map, last);
    if (reading && reading.textContent !== words) reading.textContent = words;
  };
  const follow = ({ target, clientX, clientY }) => {
    const map = mapAt(target);
    if (!map && last?.target.isConnected) {
      const left = mapAt(last.target);
      const reading = left && readingOf(left);
      if (reading) reading.textContent = HINT;
    }
    last = map ? { target, clientX, clientY } : null;
    show();
  };
  addEventListener("pointermove", follow);
  addEventListener("pointerdown", follow);
  new MutationObserver(() => {
    if (!last) return;
    const target = document.elementFromPoint(last.clientX, last.clientY);
    last = target && mapAt(target) ? { ...last, target } : null;
    show();
  }).observe(document.body, { childList: true, subtree: true, attributeFilter: ["data-map"] });
  addEventListener("click", (event) => {
    const map = mapAt(event.target),
      facts = map && factsOf(map);
    // A click tells whole pixels, other than the pointer that read the map.
    const p = map && positionAt(map, facts, last ?? event);
    if (!p) return;
    // A pixel is wider than the last decimal.
    const rounded = p.map((value) => Number(value.toFixed(facts.decimals)));
    window.explorer.press("workspace.go", JSON.stringify(rounded));
  });
  return { leastMargin, inverseCondition, jacobian, amount };
})();
