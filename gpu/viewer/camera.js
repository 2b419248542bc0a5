// The eye: it goes around a center at some distance. Eye coordinates: x right, y up, z towards the viewer.

// Right, up and towards the viewer in world coordinates; angles in degrees (as view_rotation in gpu/camera.py).
function viewRotation(azimuth, elevation, up) {
  const around = (azimuth * Math.PI) / 180, above = (elevation * Math.PI) / 180;
  const [cosine, sine, low, high] = [Math.cos(around), Math.sin(around), Math.cos(above), Math.sin(above)];
  const rows = [
    [cosine, sine, 0],
    [-sine * high, cosine * high, low],
    [low * sine, -low * cosine, high],
  ];
  return up === "z" ? rows : rows.map(([x, y, z]) => [x, z, -y]);
}

// View and projection, column by column, of a camera for a canvas of some pixels.
function cameraMatrices(camera, width, height) {
  const { radius, parallel } = camera, aspect = width / height;
  const distance = eyeDistance(camera), shorter = Math.min(aspect, 1);
  const half = parallel ? distance * Math.tan(camera.angle / 2) : Math.tan(camera.angle / 2);
  const across = (half * aspect) / shorter, upward = half / shorter;
  const near = Math.max(distance - 1.1 * radius, 0.01 * radius);
  // There is much room behind, for surfaces that are pushed back from the lines on them.
  const far = distance + 10 * radius;
  const [right, up, towards] = viewRotation(camera.azimuth, camera.elevation, camera.up);
  const view = [0, 1, 2].flatMap((axis) => [right[axis], up[axis], towards[axis], 0]);
  view.push(camera.pan[0], camera.pan[1], -distance, 1);
  const projection = new Float32Array(16);
  projection[0] = 1 / across;
  projection[5] = 1 / upward;
  if (parallel) {
    projection[10] = -2 / (far - near);
    projection[14] = -(far + near) / (far - near);
    projection[15] = 1;
  } else {
    projection[10] = -(far + near) / (far - near);
    projection[11] = -1;
    projection[14] = (-2 * far * near) / (far - near);
  }
  return { view, projection, unit: unitPixels(camera, width, height) };
}

// Where the eye stands: at zoom 1 it sees a ball around the mesh.
function eyeDistance(camera) {
  return (1.12 * camera.radius) / Math.sin(camera.angle / 2) / camera.zoom;
}

// Pixels that a unit length at the center covers.
function unitPixels(camera, width, height) {
  return Math.min(width, height) / 2 / (eyeDistance(camera) * Math.tan(camera.angle / 2));
}
