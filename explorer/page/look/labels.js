// Draws on a canvas over the scene what keeps its size on the screen: the labels of points, the axes
// of the scene in a corner, and the size of the ground's squares. In pictures of the scene, too.
window.explorer.labels ??= (() => {
  const SIZE = 12.5,
    HEIGHT = 15,
    HALO = 3,
    ROOM = 3;
  // From a joint to the text beside it, in pixels; the nearest place that is free is taken.
  const GAPS = [2, 11, 23, 39, 59];
  // Radius of a joint, in scene units, and bounds of what it measures in the picture.
  const RADIUS = 0.3,
    RADII = [7, 22];
  // Text farther from its joint than this has a line to it.
  const FAR = 12;
  // Sides of the point, across and down, in the order in which they are tried.
  const SIDES = [
    [1, -1],
    [-1, -1],
    [1, 1],
    [-1, 1],
    [0, -1],
    [0, 1],
    [1, 0],
    [-1, 0],
  ];
  // A length that the scale may have, in pixels.
  const BAR = [36, 96];
  // Half the side of the square about the middle of the drag handle that stays free.
  const HANDLE = 13;
  // Radius of the ring that the tour draws about the handle.
  const RING = 78;
  // A body hides a point if it is so much nearer to the eye, in scene units, as a joint is thick.
  const JOINT = 0.8;
  const PALE = 0.35;
  // Milliseconds between two looks at what hides the points.
  const LOOK = 150;
  // The axes: centre from the left and from below, and length, in pixels; the scale is beside them in
  // a scene of at least some width.
  const AXES = { left: 42, up: 42, length: 27, room: 200 };
  // The colours of the drag handle.
  const COLOURS = ["#ff2060", "#20b060", "#2080ff"];
  const THEMES = {
    light: {
      text: [28, 37, 48],
      pale: [200, 205, 212],
      halo: "rgb(255 255 255 / 0.85)",
      towards: 0,
    },
    dark: { text: [233, 236, 241], pale: [70, 74, 80], halo: "rgb(20 22 26 / 0.85)", towards: 255 },
  };
  const SCALE = "/ground/scale";

  const page = () => window.__viserMutable;
  const vector = (...parts) =>
    page()
      .camera.position.clone()
      .set(...parts);
  const theme = () =>
    THEMES[document.documentElement.dataset.mantineColorScheme === "dark" ? "dark" : "light"];
  const css = (rgb) => `rgb(${rgb.map(Math.round).join(" ")})`;
  // The colour of a label, see `add_label` of scene/shapes.py; a little darker or lighter than in the scene, to be read.
  const colourOf = ({ font_scene_height: code }, { text, towards }) =>
    code >= 1 ? [16, 8, 0].map((bits) => 0.75 * ((code >> bits) & 255) + 0.25 * towards) : text;

  // Nodes of the scene that are shown, of some types of message.
  const nodes = (...types) =>
    Object.entries(window.__viserSceneTree.getState())
      .filter(([, node]) => node?.effectiveVisibility && types.includes(node.message.type))
      .map(([name, node]) => ({ name, props: node.message.props }));
  const placeOf = (name) => {
    const parent = page().nodeRefFromName[name.slice(0, name.lastIndexOf("/"))];
    const position = page().nodePoseData[name]?.position ?? [0, 0, 0];
    return parent && vector(...position).applyMatrix4(parent.matrixWorld);
  };
  // A view is a camera and the size, in pixels, of what it draws. Pixels of a scene unit at a place:
  const unitAt = ({ camera, height }, place) => {
    const { x, y, z } = place.clone().applyMatrix4(camera.matrixWorldInverse);
    const shareAt = (each) => vector(x, each, z).applyMatrix4(camera.projectionMatrix).y;
    return 0.5 * height * (shareAt(y + 1) - shareAt(y));
  };
  // A place behind the camera has no pixels.
  const pixelsOf = ({ camera, width, height }, place) => {
    const { x, y, z } = place.clone().applyMatrix4(camera.matrixWorldInverse);
    if (z > 0 && !window.explorer.projection.isParallel(camera)) return null;
    const at = vector(x, y, z).applyMatrix4(camera.projectionMatrix);
    return [(0.5 + 0.5 * at.x) * width, (0.5 - 0.5 * at.y) * height];
  };

  const widths = new Map();
  const widthOf = (pen, text) => {
    if (!widths.has(text)) widths.set(text, pen.measureText(text).width);
    return widths.get(text);
  };
  const boxAt = ([x, y], width, side, gap) => {
    const [across, down] = SIDES[side];
    // Beside a corner of the text the point is as far away as beside an edge.
    const off = across && down ? 0.75 * gap : gap;
    const left = x + across * off - 0.5 * (1 - across) * width;
    const top = y + down * off - 0.5 * (1 - down) * HEIGHT;
    return [left, top, left + width, top + HEIGHT];
  };
  const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
  const about = ([x, y], half) => [x - half, y - half, x + half, y + half];

  // The labels whose points are hidden.
  let hidden = new Set();
  // Where the drag handle is; nowhere while it is hidden.
  const handlesIn = (view) =>
    nodes("TransformControlsMessage").flatMap(({ name }) => {
      const place = page().nodeRefFromName[name]?.matrixWorld;
      const at = place && pixelsOf(view, vector(0, 0, 0).setFromMatrixPosition(place));
      return at ? [at] : [];
    });
  const layOut = (pen, view) => {
    const { width, height } = view;
    const labels = nodes("LabelMessage").flatMap(({ name, props }) => {
      const place = name !== SCALE && placeOf(name);
      const at = place && pixelsOf(view, place);
      const isSeen = at && at[0] >= 0 && at[1] >= 0 && at[0] <= width && at[1] <= height;
      if (!isSeen) return [];
      const radius = Math.min(Math.max(RADIUS * unitAt(view, place), RADII[0]), RADII[1]);
      return [{ name, text: props.text, place, at, radius, props }];
    });
    const points = labels.map(({ at }) => about(at, 4));
    const taken = handlesIn(view).map((at) => about(at, HANDLE));
    taken.push([0, height - 2 * AXES.up, 2 * AXES.left, height]);
    for (const label of labels) {
      const length = widthOf(pen, label.text);
      let best = null;
      GAPS.forEach((gap, ring) => {
        SIDES.forEach((_, side) => {
          const box = boxAt(label.at, length, side, label.radius + gap);
          const number = ring * SIDES.length + side;
          const hits = taken.filter((other) => overlap(box, other)).length;
          const covered = points.filter((other) => overlap(box, other)).length;
          const isOut = box[0] < 2 || box[1] < 2 || box[2] > width - 2 || box[3] > height - 2;
          const cost = number + 1000 * hits + 9 * covered + (isOut ? 500 : 0);
          if (!best || cost < best.cost) best = { cost, box, gap };
        });
      });
      Object.assign(label, { box: best.box, gap: best.gap });
      // A little room between two texts.
      const [left, top, right, bottom] = best.box;
      taken.push([left - ROOM, top, right + ROOM, bottom]);
    }
    return labels;
  };

  const write = (pen, text, x, y, colour, halo) => {
    pen.lineWidth = HALO;
    pen.strokeStyle = halo;
    pen.strokeText(text, x, y);
    pen.fillStyle = colour;
    pen.fillText(text, x, y);
  };
  const stroke = (pen, width, colour, ...lines) => {
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.beginPath();
    for (const [x0, y0, x1, y1] of lines) {
      pen.moveTo(x0, y0);
      pen.lineTo(x1, y1);
    }
    pen.stroke();
  };
  const writeLabel = (pen, { name, text, at: [x, y], box, gap, props }, look) => {
    // What is pale is so on its whole halo, also in front of a dark body.
    const share = hidden.has(name) ? PALE : 1;
    const colour = css(
      colourOf(props, look).map((part, k) => share * part + (1 - share) * look.pale[k]),
    );
    if (gap > FAR) {
      // A line leads from a label that is not beside its point to it.
      const nearest = [x, y].map((at, k) => Math.min(Math.max(at, box[k]), box[k + 2]));
      stroke(pen, 1, colour, [x, y, ...nearest]);
    }
    pen.textAlign = "left";
    write(pen, text, box[0], 0.5 * (box[1] + box[3]), colour, look.halo);
  };
  // The axes of the scene as the camera sees them: across, down, and towards the eye.
  const axesOf = ({ camera }) => {
    const root = page().nodeRefFromName[""]?.matrixWorld ?? camera.matrixWorld.clone().identity();
    const turn = camera.matrixWorldInverse.clone().multiply(root).elements;
    return [0, 1, 2].map((axis) => [turn[4 * axis], -turn[4 * axis + 1], turn[4 * axis + 2]]);
  };
  const drawAxes = (pen, view, look) => {
    const [x, y] = [AXES.left, view.height - AXES.up];
    const axes = axesOf(view).map((along, axis) => ({ along, axis }));
    // Those that point away from the eye lie behind the others.
    axes.sort((one, other) => one.along[2] - other.along[2]);
    pen.textAlign = "center";
    for (const { along, axis } of axes) {
      const size = Math.hypot(along[0], along[1]);
      const tip = [x + AXES.length * along[0], y + AXES.length * along[1]];
      stroke(pen, 2.5, COLOURS[axis], [x, y, ...tip]);
      pen.fillStyle = COLOURS[axis];
      pen.beginPath();
      pen.arc(...tip, 3, 0, 2 * Math.PI);
      pen.fill();
      // The name of an axis along the line of sight stands beside it.
      const away = size < 0.2 ? [-0.4, 0.4] : [along[0] / size, along[1] / size];
      const off = size < 0.2 ? 20 : 10;
      const [left, top] = tip.map((part, k) => part + off * away[k]);
      write(pen, "xyz"[axis], left, top, COLOURS[axis], look.halo);
    }
  };
  const lengthText = (size, unit) =>
    `${size.toLocaleString("en", { maximumSignificantDigits: 6 })} ${unit}`;
  // What tells the size of things: a bar where it is the same at every depth, and else the size of
  // the squares on the ground.
  const scaleOf = ({ camera, width, height }) => {
    const label = nodes("LabelMessage").find(({ name }) => name === SCALE);
    const grid = nodes("GridMessage")[0];
    if (!label || !grid || width < AXES.room) return null;
    const [text, unit] = label.props.text.split(" ");
    let size = Number(text);
    if (!window.explorer.projection.isParallel(camera)) {
      return { length: 0, text: `1 square = ${lengthText(size, unit)}` };
    }
    let length = 0.5 * height * camera.projectionMatrix.elements[5] * grid.props.cell_size;
    // A length of 1, 2 or 5 times a power of ten, as that of a square is.
    const digit = () => Number(size.toExponential(6)[0]);
    const times = (factor) => {
      size *= factor;
      length *= factor;
    };
    while (length < BAR[0]) times(digit() === 2 ? 2.5 : 2);
    while (length > BAR[1]) times(digit() === 5 ? 0.4 : 0.5);
    return { length, text: lengthText(size, unit) };
  };
  const drawScale = (pen, view, look) => {
    const scale = scaleOf(view);
    if (!scale) return;
    const { length, text } = scale;
    let left = 2 * AXES.left;
    const y = view.height - 14;
    pen.globalAlpha = 0.75;
    if (length) {
      const ends = [left, left + length].map((x) => [x, y - 4, x, y + 4]);
      const lines = [...ends, [left, y, left + length, y]];
      stroke(pen, 1.5 + HALO, look.halo, ...lines);
      stroke(pen, 1.5, css(look.text), ...lines);
      left += length + 8;
    }
    pen.textAlign = "left";
    write(pen, text, left, y, css(look.text), look.halo);
    pen.globalAlpha = 1;
  };
  const paint = (pen, view) => {
    const look = theme();
    pen.textBaseline = "middle";
    pen.lineJoin = "round";
    pen.lineCap = "round";
    const family = getComputedStyle(document.body).fontFamily;
    pen.font = `400 ${SIZE}px ${family}`;
    drawScale(pen, view, look);
    pen.font = `600 ${SIZE}px ${family}`;
    drawAxes(pen, view, look);
    const labels = layOut(pen, view);
    // Those that are hidden lie below the others.
    labels.sort((one, other) => hidden.has(other.name) - hidden.has(one.name));
    for (const label of labels) writeLabel(pen, label, look);
    return labels;
  };

  // As the stylesheet rings a control.
  const ringHandle = (pen, view) => {
    pen.lineWidth = 2;
    pen.strokeStyle = getComputedStyle(canvas).color;
    for (const at of handlesIn(view)) {
      pen.beginPath();
      pen.arc(...at, RING, 0, 2 * Math.PI);
      pen.stroke();
    }
  };

  const canvas = window.explorer.make("canvas", { className: "ex-labels", ariaHidden: "true" });
  canvas.style.cssText = "position:absolute;inset:0;pointer-events:none;color:var(--ex-ring)";
  // A picture of the scene alone hides what is not its canvas.
  canvas.style.setProperty("visibility", "visible", "important");
  let drawn = [],
    shownHeight = 1;
  const pageView = () => {
    const { canvas: scene, camera } = page();
    // The size that the scene is drawn for; paper may show it in another one.
    const [width, height] = [scene.style.width, scene.style.height].map(parseFloat);
    return { camera, width, height };
  };
  const repaint = () => {
    const { canvas: scene } = page();
    if (canvas.parentElement !== scene.parentElement) scene.after(canvas);
    const { width, height } = pageView();
    shownHeight = height;
    const ratio = devicePixelRatio;
    const sides = [Math.floor(ratio * width), Math.floor(ratio * height)];
    // A canvas that takes a size is cleared and loses its pen's properties.
    if (canvas.width !== sides[0] || canvas.height !== sides[1]) {
      [canvas.width, canvas.height] = sides;
      // Paper may have another room for the scene, whose canvas keeps its size there.
      [canvas.style.width, canvas.style.height] = [`${width}px`, `${height}px`];
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawn = paint(pen, pageView());
    if (window.explorer.ringsHandle) ringHandle(pen, pageView());
    lookSoon();
  };
  // How much larger a picture of some height shows the scene than the page does.
  const growth = (camera, height) => {
    const slope = (each) => Math.tan((each.fov * Math.PI) / 360);
    return ((height / shownHeight) * slope(page().camera)) / slope(camera);
  };
  // The lines grow with the picture, too: three.js has their thickness in pixels.
  const thicken = (factor) => {
    const materials = new Set();
    page().scene.traverse(({ material }) => material?.isLineMaterial && materials.add(material));
    for (const material of materials) material.linewidth *= factor;
  };
  let thickened = 1;
  const prepare = (camera) => {
    if (camera === page().camera) return;
    // The page is drawn again after a picture.
    look();
    // The canvas of the scene has the size of the picture for now.
    thickened = growth(camera, page().canvas.clientHeight);
    thicken(thickened);
  };
  // Viser takes a picture from the canvas of the scene as soon as it is drawn: the labels follow.
  const drawInPicture = (camera) => {
    const pens = CanvasRenderingContext2D.prototype,
      drawImage = pens.drawImage;
    pens.drawImage = function drawAndLabel(...all) {
      pens.drawImage = drawImage;
      drawImage.apply(this, all);
      const { width, height } = this.canvas;
      const factor = growth(camera, height);
      this.save();
      this.scale(factor, factor);
      paint(this, { camera, width: width / factor, height: height / factor });
      this.restore();
    };
  };

  // Bodies that hide what is behind them.
  const bodies = () =>
    nodes("MeshMessage", "BatchedMeshesMessage", "IcosphereMessage")
      .filter(({ props }) => (props.opacity ?? 1) > 0.95 && !props.wireframe)
      .flatMap(({ name }) => page().nodeRefFromName[name] ?? []);
  const isHidden = (raycaster, objects, { place }) => {
    const { camera } = page();
    raycaster.setFromCamera(place.clone().project(camera), camera);
    raycaster.near = 0;
    raycaster.far = raycaster.ray.origin.distanceTo(place) - JOINT;
    return raycaster.intersectObjects(objects, true).some(({ object }) => object.isMesh);
  };
  // Find which points are hidden; say whether others were before.
  const look = () => {
    const { constructor: Raycaster } = page().scene.__r3f.root.getState().raycaster;
    const raycaster = new Raycaster(),
      objects = bodies();
    const found = drawn.filter(
      (label) => label.props.depth_test && isHidden(raycaster, objects, label),
    );
    const names = found.map(({ name }) => name);
    if (names.length === hidden.size && names.every((name) => hidden.has(name))) return false;
    hidden = new Set(names);
    return true;
  };
  let timer = null;
  const lookSoon = () => {
    timer ??= window.explorer.clock.after(LOOK, () => {
      timer = null;
      if (look()) repaint();
    });
  };

  // Viser's own labels, which have boxes.
  let boxes = null;
  const hideBoxes = () => {
    if (!boxes) {
      page().scene.traverse((each) => {
        if (each.material?.uniforms?.uLabelData) boxes = each.parent;
      });
    }
    if (boxes) boxes.visible = false;
  };
  const draw = (camera) => {
    hideBoxes();
    if (camera === page().camera) {
      repaint();
      return;
    }
    thicken(1 / thickened);
    drawInPicture(camera);
  };
  return {
    prepare,
    draw,
    drawn: () => drawn,
    hidden: () => hidden,
    scale: () => scaleOf(pageView()),
  };
})();
