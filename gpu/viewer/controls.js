// Mouse, touch, keys and buttons: each changes the state and asks for a new picture.

const TURN = 0.4; // degrees for a pixel
const STEP = 5; // degrees for an arrow key

// What can be done, in the order of the help: keys, words, and what happens; `label` and `on` make it a button.
function actionsOf(scene, state) {
  const style = (name) => ({ label: name, on: () => state.style === name, run: () => (state.style = name) });
  const flag = (name, label) => ({ label, on: () => state[name], run: () => (state[name] = !state[name]) });
  const turn = (x, y) => ({ run: () => turnBy(state, x, y) });
  const actions = [
    { keys: "s", words: "light and shade", ...style("shaded") },
    { keys: "z", words: "zebra: reflections of a striped room", ...style("zebra") },
    { keys: "n", words: "normals as colors", ...style("normals") },
    { keys: "w", words: "edges of the polygons", ...flag("wire", "wire") },
    { keys: "f", words: "flat faces", ...flag("flat", "flat") },
    { keys: "p", words: "parallel projection", ...flag("parallel", "parallel") },
    { keys: " ", shown: "space", words: "turntable", ...flag("turning", "turn") },
    { keys: "r", words: "the first view again (or double click)", label: "reset", run: () => resetView(scene, state) },
    { keys: "h?", shown: "h", words: "this help", ...flag("help", "?") },
    { keys: "ArrowLeft", shown: "arrows", words: "turn (or drag)", ...turn(-STEP, 0) },
    { keys: "ArrowRight", ...turn(STEP, 0) },
    { keys: "ArrowUp", ...turn(0, STEP) },
    { keys: "ArrowDown", ...turn(0, -STEP) },
    { keys: "+=", shown: "+ -", words: "closer, farther (or wheel, pinch)", run: () => zoomBy(state, 1.1) },
    { keys: "-_", run: () => zoomBy(state, 1 / 1.1) },
    { shown: "shift", words: "and drag, or two fingers: shift the mesh" },
  ];
  if (scene.scale) actions.splice(3, 0, { keys: "v", words: "values as colors", ...style("values"), label: "values" });
  if (scene.control)
    actions.splice(3, 0, { keys: "c", words: "the coarse mesh over it", ...flag("control", "coarse") });
  if (scene.models.length > 1) actions.push({ shown: "1-9", words: "other meshes" });
  return actions;
}

function turnBy(state, x, y) {
  state.azimuth += x;
  state.elevation = Math.max(-90, Math.min(90, state.elevation + y));
}

function zoomBy(state, factor) {
  state.zoom = Math.max(0.1, Math.min(60, state.zoom * factor));
}

function resetView(scene, state) {
  [state.azimuth, state.elevation] = scene.look.view;
  Object.assign(state, { zoom: 1, pan: [0, 0], turning: false });
}

// Buttons, the list of meshes and the help; returns what shows the state in them.
function buildPage(scene, state, actions, redraw) {
  const bar = document.getElementById("bar"), buttons = [];
  const select = document.createElement("select");
  if (scene.models.length > 1) {
    select.setAttribute("aria-label", "mesh");
    scene.models.forEach((model, k) => select.add(new Option(model.name, k)));
    select.onchange = () => redraw((state.model = Number(select.value)));
    bar.append(select);
  }
  for (const action of actions.filter((one) => one.label)) {
    const button = document.createElement("button");
    button.textContent = action.label;
    button.title = action.words;
    button.onclick = () => redraw(action.run());
    bar.append(button);
    buttons.push([button, action]);
  }
  const table = document.createElement("table");
  for (const action of actions.filter((one) => one.words)) {
    const row = table.insertRow();
    row.insertCell().textContent = action.shown || action.keys;
    row.insertCell().textContent = action.words;
  }
  document.getElementById("help").append(table);
  return () => {
    for (const [button, action] of buttons) if (action.on) button.setAttribute("aria-pressed", action.on());
    select.value = state.model;
    document.getElementById("help").hidden = !state.help;
    document.getElementById("facts").textContent = scene.models[state.model].facts;
    document.getElementById("scale").hidden = state.style !== "values";
  };
}

function listenToKeys(scene, state, actions, redraw) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    // A button that has the focus is pressed by the space bar itself.
    if (event.key === " " && event.target.closest("button, select")) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const action = actions.find((one) => one.keys && (one.keys === key || (key.length === 1 && one.keys.length < 3 && one.keys.includes(key))));
    if (action) action.run();
    else if (/^[1-9]$/.test(key) && Number(key) <= scene.models.length) state.model = Number(key) - 1;
    else return;
    event.preventDefault();
    redraw();
  });
}

function listenToPointers(canvas, scene, state, unit, redraw) {
  const down = new Map();
  const middle = () => {
    const places = [...down.values()], [a, b = a] = places;
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  // Shift and zoom so that what was under one place of the canvas comes under another.
  const follow = (from, to, factor) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const lengths = ({ x, y }) => [(x - left - width / 2) / unit(), (top + height / 2 - y) / unit()];
    const before = lengths(from);
    zoomBy(state, factor);
    const after = lengths(to);
    state.pan = [0, 1].map((axis) => state.pan[axis] + after[axis] - before[axis]);
  };
  canvas.addEventListener("pointerdown", (event) => {
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    try {
      canvas.setPointerCapture(event.pointerId);
    } catch {
      // The pointer has left already.
    }
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!down.has(event.pointerId)) return;
    const before = middle();
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const now = middle(), two = down.size === 2 && before.apart > 0 && now.apart > 0;
    if (down.size > 1 || event.shiftKey || event.buttons > 1) follow(before, now, two ? now.apart / before.apart : 1);
    else turnBy(state, -TURN * (now.x - before.x), TURN * (now.y - before.y));
    redraw();
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    canvas.addEventListener(name, (event) => down.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => redraw(resetView(scene, state)));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      zoomBy(state, Math.exp(-0.0015 * lines * event.deltaY));
      redraw();
    },
    { passive: false },
  );
}
