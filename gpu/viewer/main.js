// The page: unpacks the meshes, draws when something has changed. Settings after '#' in its address come first:
// style=zebra, wire=1, control=0, flat=1, parallel=1, help=1, model=2, zoom=1.5, view=30,25.

function say(text) {
  const message = document.getElementById("message");
  message.textContent = text;
  message.hidden = !text;
}

function startState(scene) {
  const { style, wire, control, view } = scene.look;
  const state = { style, wire, control, flat: false, parallel: false, turning: false, help: false, model: 0, zoom: 1 };
  const asked = new URLSearchParams(location.hash.slice(1));
  for (const name of ["wire", "control", "flat", "parallel", "help", "turning"])
    if (asked.has(name)) state[name] = asked.get(name) !== "0";
  const styles = ["shaded", "zebra", "normals", ...(scene.scale ? ["values"] : [])];
  if (styles.includes(asked.get("style"))) state.style = asked.get("style");
  const model = Number(asked.get("model")), zoom = Number(asked.get("zoom"));
  if (Number.isInteger(model) && model >= 1 && model <= scene.models.length) state.model = model - 1;
  const angles = (asked.get("view") || "").split(",").map(parseFloat);
  [state.azimuth, state.elevation] = angles.length === 2 && angles.every(Number.isFinite) ? angles : view;
  state.pan = [0, 0];
  if (zoom > 0) zoomBy(state, zoom);
  return state;
}

function showScale(scene) {
  if (!scene.scale) return;
  document.getElementById("ramp").style.background = `linear-gradient(to right, ${scene.scale.colors.join(",")})`;
  for (const name of ["low", "high", "what"]) document.getElementById(name).textContent = scene.scale[name];
}

async function unpackMesh(mesh) {
  const names = Object.keys(mesh.arrays);
  const arrays = await Promise.all(names.map((name) => unpack(mesh.arrays[name])));
  return Object.fromEntries(names.map((name, k) => [name, arrays[k]]));
}

async function start() {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const canvas = document.getElementById("view");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
  if (!gl) throw new Error("This page needs WebGL 2, which this browser does not offer.");
  if (typeof DecompressionStream === "undefined") throw new Error("This page needs a browser of 2023 or later.");
  const models = await Promise.all(scene.models.map(unpackMesh));
  const control = scene.control && (await unpackMesh(scene.control));
  const state = startState(scene);
  let painter = new Painter(gl, scene, models, control), asked = false, last = 0;

  const camera = () => ({ ...state, radius: scene.models[state.model].radius, up: scene.look.up, angle: scene.look.angle });
  const actions = actionsOf(scene, state);
  const show = buildPage(scene, state, actions, redraw);
  showScale(scene);

  function redraw() {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  }

  function draw(time) {
    asked = false;
    const density = devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * density));
    const height = Math.max(1, Math.round(canvas.clientHeight * density));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    if (state.turning) turnBy(state, 0.03 * Math.min(time - last, 100), 0);
    last = time;
    show();
    if (!gl.isContextLost()) painter.draw(state, cameraMatrices(camera(), width, height), width, height, density);
    if (state.turning) redraw();
  }

  listenToKeys(scene, state, actions, redraw);
  listenToPointers(canvas, scene, state, () => unitPixels(camera(), canvas.clientWidth, canvas.clientHeight), redraw);
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => redraw((painter = new Painter(gl, scene, models, control))));
  addEventListener("resize", redraw);
  canvas.focus();
  draw(0);
}

start().catch((error) => say(error.message));
