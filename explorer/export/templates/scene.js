// The scene: meshes that WebGL draws, with a camera that pointers and keys turn, and labels above.
// `redraw` is called when the camera has moved; draw again then.
window.sceneOf = (canvas, labels, { along, minus, length, cross, dot }, redraw) => {
  // What is drawn is kept, or it would be black on paper.
  const settings = { alpha: false, antialias: true, stencil: true, preserveDrawingBuffer: true };
  const gl = canvas.getContext("webgl2", settings);
  const HALF_VIEW = Math.tan((16 * Math.PI) / 180);
  const STRIDE = 10;

  const camera = { azimuth: -0.947, elevation: 0.467, distance: 1, target: [0, 0, 0] };
  const unit = (a) => {
    const size = length(a);
    return size > 0 ? a.map((value) => value / size) : [0, 0, 1];
  };
  const blend = (...terms) => terms.reduce((sum, [share, a]) => along(sum, share, a), [0, 0, 0]);

  // --- Meshes: vertices of position, normal and colour; one without a normal has its colour as it is.
  const newMesh = () => ({ data: new Float32Array(1 << 17), used: 0 });
  const solid = newMesh();
  let [casting, panes] = [0, []];

  const write = (list, ...numbers) => {
    if (list.used + STRIDE > list.data.length) {
      const larger = new Float32Array(2 * list.data.length);
      larger.set(list.data);
      list.data = larger;
    }
    for (let k = 0; k < STRIDE; k += 1) list.data[list.used + k] = numbers[k];
    list.used += STRIDE;
  };
  const inkOf = ([red, green, blue, alpha = 1]) => [red / 255, green / 255, blue / 255, alpha];
  const polygon = (list, corners, normal, ink) => {
    for (let k = 1; k + 1 < corners.length; k += 1)
      for (const corner of [corners[0], corners[k], corners[k + 1]])
        write(list, ...corner, ...normal, ...ink);
  };
  // A flat convex face.
  const face = (corners, colour) => {
    const [a, b, c] = corners;
    polygon(solid, corners, unit(cross(minus(b, a), minus(c, a))), inkOf(colour));
  };
  // A translucent one, or a fan about its first corner.
  const pane = (corners, colour) => {
    const share = 1 / corners.length;
    panes.push({ corners, colour, centre: blend(...corners.map((corner) => [share, corner])) });
  };

  // Surfaces of revolution about z, of points (radius, height, and the normal's two parts).
  const ring = (sides) =>
    Array.from({ length: sides + 1 }, (_, k) => {
      const angle = (2 * Math.PI * k) / sides;
      return [Math.cos(angle), Math.sin(angle)];
    });
  const revolve = (profile, sides) => {
    const around = ring(sides);
    const at = ([radius, height, out, up], [c, s]) => [
      radius * c,
      radius * s,
      height,
      out * c,
      out * s,
      up,
    ];
    const vertices = [];
    for (let row = 0; row + 1 < profile.length; row += 1)
      for (let k = 0; k < sides; k += 1) {
        const [lower, upper] = [profile[row], profile[row + 1]];
        const [now, next] = [around[k], around[k + 1]];
        const [p, q] = [at(lower, now), at(upper, next)];
        vertices.push(p, at(lower, next), q, p, q, at(upper, now));
      }
    return vertices;
  };
  const SIDE = [
    [1, 0, 1, 0],
    [1, 1, 1, 0],
  ];
  const ENDS = [
    [0, 0, 0, -1],
    [1, 0, 0, -1],
    [1, 1, 0, 1],
    [0, 1, 0, 1],
  ];
  const CYLINDER = [
    ...revolve(SIDE, 20),
    ...[0, 2].flatMap((k) => revolve(ENDS.slice(k, k + 2), 20)),
  ];
  const LINE = revolve(SIDE, 7);
  const arc = Array.from({ length: 11 }, (_, k) => (Math.PI * k) / 10);
  const SPHERE = revolve(
    arc.map((angle) => [Math.sin(angle), Math.cos(angle), Math.sin(angle), Math.cos(angle)]),
    18,
  );

  // Add a surface whose x, y and z axes become u, v and w, with two scales for across and along.
  const put = (vertices, origin, [u, v, w], across, stretch, colour) => {
    const [red, green, blue, alpha] = inkOf(colour);
    for (const [x, y, z, nx, ny, nz] of vertices) {
      const [sx, sy, sz] = [across * x, across * y, stretch * z];
      write(
        solid,
        origin[0] + sx * u[0] + sy * v[0] + sz * w[0],
        origin[1] + sx * u[1] + sy * v[1] + sz * w[1],
        origin[2] + sx * u[2] + sy * v[2] + sz * w[2],
        nx * u[0] + ny * v[0] + nz * w[0],
        nx * u[1] + ny * v[1] + nz * w[1],
        nx * u[2] + ny * v[2] + nz * w[2],
        red,
        green,
        blue,
        alpha,
      );
    }
  };
  const between = (vertices, from, to, radius, colour) => {
    const w = unit(minus(to, from));
    const u = unit(cross(w, Math.abs(w[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
    put(vertices, from, [u, cross(w, u), w], radius, length(minus(to, from)), colour);
  };
  const tube = (...ends) => between(CYLINDER, ...ends);
  const line = (...ends) => between(LINE, ...ends);
  const UPRIGHT = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  const ball = (centre, radius, colour) => put(SPHERE, centre, UPRIGHT, radius, radius, colour);

  // The hull of discs around points of a plane, from height `low` to `high` above it; `place` puts
  // it into the scene.
  const plate = (points, radius, low, high, colour, place = (point) => point) => {
    const rim = hull(
      points.flatMap(([x, y]) => ring(20).map(([c, s]) => [x + radius * c, y + radius * s])),
    );
    const at = (height) => rim.map(([x, y]) => place([x, y, height]));
    const [below, above] = [at(low), at(high)];
    face(above, colour);
    face(below.toReversed(), colour);
    rim.forEach((_, k) => {
      const next = (k + 1) % rim.length;
      face([below[k], below[next], above[next], above[k]], colour);
    });
  };
  const box = (low, high, colour) => {
    const corners = [
      [low[0], low[1]],
      [high[0], low[1]],
      [high[0], high[1]],
      [low[0], high[1]],
    ];
    plate(corners, 0, low[2], high[2], colour);
  };
  const hull = (points) => {
    const sorted = points.toSorted((a, b) => a[0] - b[0] || a[1] - b[1]);
    const half = (list) => {
      const chain = [];
      for (const point of list) {
        const turns = ([a, b]) =>
          (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0;
        while (chain.length > 1 && !turns(chain.slice(-2))) chain.pop();
        chain.push(point);
      }
      return chain.slice(0, -1);
    };
    return [...half(sorted), ...half(sorted.toReversed())];
  };

  // --- The camera.
  const axesOf = () => {
    const { azimuth, elevation } = camera;
    const [ca, sa, ce, se] = [azimuth, elevation].flatMap((a) => [Math.cos(a), Math.sin(a)]);
    const back = [ce * ca, ce * sa, se];
    const right = [-sa, ca, 0];
    return { back, right, up: cross(back, right) };
  };
  const sizeOf = () => [canvas.clientWidth || 1, canvas.clientHeight || 1];

  // The matrix from the scene to the clip space of WebGL, column by column.
  const matrixOf = () => {
    const { back, right, up } = axesOf();
    const [width, height] = sizeOf();
    const eye = along(camera.target, camera.distance, back);
    const [near, far] = [0.02 * camera.distance, 40 * camera.distance];
    const [sx, sy] = [height / width / HALF_VIEW, 1 / HALF_VIEW];
    const sz = (near + far) / (near - far);
    const tz = (2 * near * far) / (near - far);
    const depth = [...back.map((value) => sz * value), -sz * dot(back, eye) + tz];
    const rowsOf = [
      [...right.map((value) => sx * value), -sx * dot(right, eye)],
      [...up.map((value) => sy * value), -sy * dot(up, eye)],
      depth,
      [...back.map((value) => -value), dot(back, eye)],
    ];
    return [0, 1, 2, 3].flatMap((j) => rowsOf.map((row) => row[j]));
  };

  // Where a point is seen, in pixels from the upper left corner; null behind the camera.
  const project = (point) => {
    const { back, right, up } = axesOf();
    const [width, height] = sizeOf();
    const away = minus(point, camera.target);
    const depth = camera.distance - dot(away, back);
    if (depth <= 0) return null;
    const scale = height / (2 * HALF_VIEW * depth);
    return [0.5 * width + scale * dot(away, right), 0.5 * height - scale * dot(away, up)];
  };

  // Move the camera so that it sees all of some points.
  const fit = (points) => {
    const { back, right, up } = axesOf();
    const [width, height] = sizeOf();
    const lows = [0, 1, 2].map((i) => Math.min(...points.map((point) => point[i])));
    const highs = [0, 1, 2].map((i) => Math.max(...points.map((point) => point[i])));
    const centre = blend([0.5, lows], [0.5, highs]);
    camera.target = centre;
    camera.distance = 0;
    for (const [axis, slope] of [
      [up, HALF_VIEW],
      [right, (HALF_VIEW * width) / height],
    ]) {
      const ends = [1, -1].map((sign) =>
        Math.max(
          ...points.map((point) => {
            const away = minus(point, centre);
            return sign * dot(away, axis) + slope * dot(away, back);
          }),
        ),
      );
      camera.distance = Math.max(camera.distance, (0.54 * (ends[0] + ends[1])) / slope);
      camera.target = along(camera.target, 0.5 * (ends[0] - ends[1]), axis);
    }
    redraw();
  };

  // Whether some points are all in the picture.
  const sees = (points) => {
    const [width, height] = sizeOf();
    return points.every((point) => {
      const [x, y] = project(point) ?? [-1, -1];
      return x >= 0 && x <= width && y >= 0 && y <= height;
    });
  };

  const turnTo = (azimuth, elevation) => {
    camera.azimuth = azimuth;
    camera.elevation = Math.min(1.55, Math.max(-1.55, elevation));
    redraw();
  };
  const rotate = (x, y) => turnTo(camera.azimuth - x, camera.elevation + y);
  const lookFrom = ([x, y, z]) => turnTo(Math.atan2(y, x), Math.atan2(z, Math.hypot(x, y)));
  const zoom = (factor) => {
    camera.distance *= factor;
    redraw();
  };
  const pan = (x, y) => {
    const { right, up } = axesOf();
    const scale = (2 * HALF_VIEW * camera.distance) / sizeOf()[1];
    camera.target = along(along(camera.target, -x * scale, right), y * scale, up);
    redraw();
  };

  const pointers = new Map();
  const spread = () => {
    const [a, b] = pointers.values();
    return Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const [x, y] = [event.clientX - last.x, event.clientY - last.y];
    const before = pointers.size === 2 ? spread() : 1;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 2) {
      pan(0.5 * x, 0.5 * y);
      zoom(before / spread());
    } else if (event.shiftKey || event.buttons > 1) pan(x, y);
    else rotate(0.008 * x, 0.008 * y);
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      zoom(Math.exp(0.0012 * Math.max(-300, Math.min(300, event.deltaY))));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const step = 0.08;
    const moves = {
      ArrowLeft: () => rotate(-step, 0),
      ArrowRight: () => rotate(step, 0),
      ArrowUp: () => rotate(0, -step),
      ArrowDown: () => rotate(0, step),
      "+": () => zoom(0.9),
      "=": () => zoom(0.9),
      "-": () => zoom(1 / 0.9),
    };
    const move = moves[event.key];
    if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    move();
  });

  // --- Drawing.
  const BODY_VERTEX = `#version 300 es
    uniform mat4 view; uniform vec4 shadow; uniform float ground;
    layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal;
    layout(location = 2) in vec4 colour; out vec3 facing; out vec4 tint;
    void main() {
      // A shadow is what falls on the ground along the light.
      vec3 fallen = position - shadow.xyz * ((position.z - ground) / shadow.z);
      gl_Position = view * vec4(shadow.w > 0.0 ? fallen : position, 1.0);
      facing = normal; tint = shadow.w > 0.0 ? vec4(0.0, 0.0, 0.0, shadow.w) : colour;
    }`;
  const BODY_FRAGMENT = `#version 300 es
    precision highp float; uniform vec3 light; uniform vec3 back;
    in vec3 facing; in vec4 tint; out vec4 pixel;
    void main() {
      float shade = 1.0; float gloss = 0.0;
      if (dot(facing, facing) > 0.25) {
        vec3 n = normalize(facing); if (dot(n, back) < 0.0) n = -n;
        shade = 0.6 + 0.34 * max(0.0, dot(n, light)) + 0.1 * n.z;
        gloss = 0.22 * pow(max(0.0, dot(n, normalize(light + back))), 24.0);
      }
      pixel = vec4(min(vec3(1.0), tint.rgb * shade + gloss), tint.a);
    }`;
  const GRID_VERTEX = `#version 300 es
    uniform mat4 view; uniform vec3 centre; uniform float reach; out vec2 place;
    void main() {
      vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
      place = centre.xy + corner * reach;
      gl_Position = view * vec4(place, centre.z, 1.0);
    }`;
  const GRID_FRAGMENT = `#version 300 es
    precision highp float; uniform vec3 centre; uniform float reach; uniform float cell;
    uniform vec4 ink; in vec2 place; out vec4 pixel;
    float line(vec2 at) {
      vec2 width = fwidth(at); vec2 away = abs(fract(at - 0.5) - 0.5) / width;
      vec2 seen = (1.0 - min(vec2(1.0), away)) * clamp(0.35 / width - 0.4, 0.0, 1.0);
      return max(seen.x, seen.y);
    }
    void main() {
      float fade = 1.0 - smoothstep(0.25, 1.0, distance(place, centre.xy) / reach);
      pixel = vec4(ink.rgb, ink.a * fade * max(0.55 * line(place / cell), line(place / cell / 5.0)));
    }`;

  const programOf = (...sources) => {
    const program = gl.createProgram();
    sources.forEach((source, index) => {
      const shader = gl.createShader(index ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    return { program, uniform: (name) => gl.getUniformLocation(program, name) };
  };
  const setUp = () => {
    const body = programOf(BODY_VERTEX, BODY_FRAGMENT);
    const grid = programOf(GRID_VERTEX, GRID_FRAGMENT);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    [3, 3, 4].forEach((count, index) => {
      gl.enableVertexAttribArray(index);
      gl.vertexAttribPointer(index, count, gl.FLOAT, false, 4 * STRIDE, 12 * index);
    });
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    return { body, grid };
  };
  let programs = gl && setUp();
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    programs = setUp();
    redraw();
  });

  // Draw the meshes on the ground at a height, with a grid of cells, in the colours of the theme:
  // background and lines, each red, green, blue and alpha from 0 to 1.
  const draw = ({ ground, cell, background, ink }) => {
    if (!gl || gl.isContextLost()) return;
    const [width, height] = sizeOf();
    canvas.style.setProperty("--aspect", width / height);
    const density = Math.min(2, window.devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(density * width), Math.round(density * height)];
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...background);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    const view = matrixOf();
    const { back, right, up } = axesOf();

    const { body, grid } = programs;
    gl.enable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(grid.program);
    gl.uniformMatrix4fv(grid.uniform("view"), false, view);
    gl.uniform3f(grid.uniform("centre"), camera.target[0], camera.target[1], ground);
    gl.uniform1f(grid.uniform("reach"), 4 * camera.distance);
    gl.uniform1f(grid.uniform("cell"), cell);
    gl.uniform4fv(grid.uniform("ink"), ink);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);

    gl.useProgram(body.program);
    gl.uniformMatrix4fv(body.uniform("view"), false, view);
    gl.uniform1f(body.uniform("ground"), ground);
    gl.uniform3fv(body.uniform("back"), back);
    gl.uniform3fv(body.uniform("light"), unit(blend([0.9, up], [-0.35, right], [0.6, back])));
    const load = ({ data, used }) =>
      gl.bufferData(gl.ARRAY_BUFFER, data.subarray(0, used), gl.DYNAMIC_DRAW);
    const show = (used) => gl.drawArrays(gl.TRIANGLES, 0, used / STRIDE);
    load(solid);
    if (back[2] > 0) {
      // Where shadows overlap, the ground is darkened once.
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      gl.uniform4f(body.uniform("shadow"), -0.18, 0.12, 1, 0.13);
      show(casting);
      gl.disable(gl.STENCIL_TEST);
    }
    gl.uniform4f(body.uniform("shadow"), 0, 0, 1, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    show(solid.used);
    // Translucent parts from back to front.
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    const sorted = panes.toSorted((a, b) => dot(a.centre, back) - dot(b.centre, back));
    const translucent = newMesh();
    for (const { corners, colour } of sorted)
      polygon(translucent, corners, [0, 0, 0], inkOf(colour));
    load(translucent);
    show(translucent.used);
    gl.depthMask(true);
  };

  // Write labels { text, at, colour } beside their points, so that none hides another.
  const label = (texts) => {
    while (labels.childElementCount < texts.length) labels.append(document.createElement("span"));
    const taken = [];
    const [across, down] = sizeOf();
    [...labels.children].forEach((span, index) => {
      const at = texts[index] && project(texts[index].at);
      span.hidden = !at;
      if (!at) return;
      const { text, colour } = texts[index];
      if (span.textContent !== text) span.textContent = text;
      span.className = colour ? "tinted" : "";
      span.style.setProperty("--colour", colour ?? "");
      const width = 7.2 * text.length;
      const x = at[0] + 7;
      let y = at[1] - 18;
      const hides = (each) =>
        Math.abs(each.y - y) < 14 && x < each.x + each.width && each.x < x + width;
      for (let tries = 0; tries < 6 && taken.some(hides); tries += 1) y -= 7;
      taken.push({ x, y, width });
      // Shares of the picture, which may have another size on paper.
      span.style.left = `${((100 * x) / across).toFixed(2)}%`;
      span.style.top = `${((100 * y) / down).toFixed(2)}%`;
    });
  };

  const clear = () => {
    solid.used = 0;
    panes = [];
  };
  // Let what has been added so far, and nothing that follows, cast a shadow.
  const cast = () => {
    casting = solid.used;
  };
  const shapes = { clear, cast, pane, tube, line, ball, plate, box };
  return { ...shapes, draw, label, fit, sees, lookFrom, axesOf, isReady: Boolean(gl) };
};
