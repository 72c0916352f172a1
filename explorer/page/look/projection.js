// Draws without perspective while the camera looks along an axis of the scene, upright along another
// one: in the views from the front, the side and the top, however they are shifted or enlarged. A
// length in the plane of the camera's target is as large as it is with perspective.
window.explorer.projection ??= (() => {
  // Sine of the largest angle between the camera's axes and those of the scene.
  const TOLERANCE = 1e-3;
  // What is drawn and hit lies nearer to the plane of the target than this, in scene units.
  const DEPTH = 100;
  const page = () => window.__viserMutable;

  // The axes of the scene are those of three.js in another order.
  const isAlongAxes = ({ elements }) =>
    [0, 4, 8].every(
      (column) =>
        [0, 1, 2].filter((row) => Math.abs(elements[column + row]) > TOLERANCE).length === 1,
    );
  const isParallel = (camera) => Object.hasOwn(camera, "updateProjectionMatrix");
  // Whatever computes the projection anew, as for a new size of the page, comes here.
  function project() {
    const distance = page().cameraControl.distance;
    const half = distance * Math.tan((this.fov * Math.PI) / 360);
    const across = half * this.aspect;
    const [near, far] = [distance - DEPTH, distance + DEPTH];
    const box = [-across, across, half, -half, near, far];
    this.projectionMatrix.makeOrthographic(...box, this.coordinateSystem, this.reversedDepth);
    this.projectionMatrixInverse.copy(this.projectionMatrix).invert();
  }
  const choose = (camera) => {
    if (isAlongAxes(camera.matrixWorld)) {
      camera.updateProjectionMatrix = project;
      camera.updateProjectionMatrix();
    } else if (isParallel(camera)) {
      delete camera.updateProjectionMatrix;
      camera.updateProjectionMatrix();
    }
  };
  // For three.js the camera is an orthographic one only while it draws or casts a ray: what moves the
  // camera moves one with perspective, towards the target and away from it.
  const swap = (camera) => {
    camera.isPerspectiveCamera = !camera.isPerspectiveCamera;
    camera.isOrthographicCamera = !camera.isOrthographicCamera;
  };
  // Whatever is thrown within a frame would leave three.js in the middle of it.
  const safely = (run) => {
    try {
      run();
    } catch (error) {
      console.error(error);
    }
  };
  const hook = () => {
    const scene = page()?.scene,
      raycaster = scene?.__r3f?.root.getState().raycaster;
    if (!raycaster || !page().cameraControl) {
      window.explorer.clock.atFrame(hook);
      return;
    }
    scene.onBeforeRender = ({ info }, _, camera) => {
      // The number of the frame moves on only after three.js has looked which geometries changed since
      // the last one: it would never draw one that was made anew since its shadow was drawn.
      info.render.frame += 1;
      window.explorer.layers?.mark();
      choose(camera);
      if (isParallel(camera)) swap(camera);
      safely(() => window.explorer.labels?.prepare(camera));
    };
    scene.onAfterRender = (_, __, camera) => {
      if (isParallel(camera)) swap(camera);
      safely(() => window.explorer.labels?.draw(camera));
    };
    const rays = Object.getPrototypeOf(raycaster),
      cast = rays.setFromCamera;
    rays.setFromCamera = function setFromCamera(at, camera) {
      if (!isParallel(camera)) {
        cast.call(this, at, camera);
        return;
      }
      swap(camera);
      cast.call(this, at, camera);
      swap(camera);
      // From the eye's plane to what lies before it, which is drawn too.
      this.ray.origin.addScaledVector(this.ray.direction, -DEPTH);
    };
    // A camera that glides ends by a last small step, which viser does not report.
    page().cameraControl.addEventListener("sleep", () => page().sendCamera());
    page().requestRender();
  };
  hook();
  return { isParallel };
})();
