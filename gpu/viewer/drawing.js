// Drawing with WebGL 2, by the shaders that `curvify render` draws with.

const STYLES = { shaded: 0, zebra: 1, normals: 2, values: 3 };
// The shaders work in linear light, a canvas holds what a screen shows.
const TO_SHOWN = `
#undef main
void main() {
  shade();
  vec3 light = clamp(color.rgb, 0.0, 1.0);
  color = vec4(mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light)), 1.0);
}`;
const HEAD = "#version 300 es\nprecision highp float;\nprecision highp int;\n";

class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.program = gl.createProgram();
    this.places = new Map();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, HEAD + source);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(this.program));
  }

  attribute(name) {
    return this.gl.getAttribLocation(this.program, name);
  }

  // Give uniforms their values: method is the part of gl.uniform... that tells the type.
  set(method, values) {
    for (const [name, value] of Object.entries(values)) {
      if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
      const place = this.places.get(name);
      if (method.startsWith("Matrix")) this.gl[`uniform${method}`](place, false, value);
      else this.gl[`uniform${method}`](place, value);
    }
  }
}

// Points, triangles and lines of a mesh on the device.
class Model {
  constructor(gl, programs, arrays) {
    this.gl = gl;
    this.count = arrays.triangles.length;
    const { position, normal, value } = {
      position: programs.surface.attribute("in_position"),
      normal: programs.surface.attribute("in_normal"),
      value: programs.surface.attribute("in_value"),
    };
    const buffers = {
      points: this.buffer(gl.ARRAY_BUFFER, arrays.points),
      normals: this.buffer(gl.ARRAY_BUFFER, arrays.normals),
      values: arrays.values && this.buffer(gl.ARRAY_BUFFER, arrays.values),
    };
    // Without normals the shader takes those of the facets.
    [this.smooth, this.flat] = [true, false].map((smooth) => {
      const array = this.vertexArray();
      this.attach(position, buffers.points, 3, gl.FLOAT, false);
      if (smooth) this.attach(normal, buffers.normals, 3, gl.SHORT, true);
      if (buffers.values) this.attach(value, buffers.values, 1, gl.FLOAT, false);
      if (smooth) this.indices = this.buffer(gl.ELEMENT_ARRAY_BUFFER, arrays.triangles);
      else gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
      return array;
    });
    this.wire = this.lines(programs.line, lineEnds(arrays.points, arrays.edges));
    const twice = new Uint32Array(2 * arrays.dots.length);
    arrays.dots.forEach((vertex, k) => twice.fill(vertex, 2 * k, 2 * k + 2));
    this.dots = this.lines(programs.line, lineEnds(arrays.points, twice));
  }

  vertexArray() {
    const array = this.gl.createVertexArray();
    this.gl.bindVertexArray(array);
    return array;
  }

  buffer(target, data) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
    return buffer;
  }

  attach(place, buffer, size, type, normalized, stride = 0, offset = 0, divisor = 0) {
    const gl = this.gl;
    if (place < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normalized, stride, offset);
    gl.vertexAttribDivisor(place, divisor);
  }

  lines(program, ends) {
    const array = this.vertexArray(), data = this.buffer(this.gl.ARRAY_BUFFER, ends);
    this.attach(program.attribute("in_start"), data, 3, this.gl.FLOAT, false, 24, 0, 1);
    this.attach(program.attribute("in_end"), data, 3, this.gl.FLOAT, false, 24, 12, 1);
    return { array, count: ends.length / 6 };
  }

  drawSurface(flat) {
    this.gl.bindVertexArray(flat ? this.flat : this.smooth);
    this.gl.drawElements(this.gl.TRIANGLES, this.count, this.gl.UNSIGNED_INT, 0);
  }
}

class Painter {
  constructor(gl, scene, models, control) {
    this.gl = gl;
    this.look = scene.look;
    const { surface_vert, surface_frag, line_vert, line_frag } = scene.shaders;
    this.surface = new Program(gl, surface_vert, `#define main shade\n${surface_frag}${TO_SHOWN}`);
    this.line = new Program(gl, line_vert, line_frag);
    const programs = { surface: this.surface, line: this.line };
    this.models = models.map((arrays) => new Model(gl, programs, arrays));
    this.control = control && new Model(gl, programs, control);
    gl.useProgram(this.surface.program);
    const { front, back, stops, none, stripes } = scene.look;
    this.surface.set("3fv", { front_color: front, back_color: back, no_value_color: none, "stops[0]": stops.flat() });
    this.surface.set("1f", { stripes });
  }

  draw(state, matrices, width, height, density) {
    const gl = this.gl, model = this.models[state.model];
    gl.viewport(0, 0, width, height);
    gl.clearColor(...this.look.background, 1);
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    for (const program of [this.surface, this.line]) {
      gl.useProgram(program.program);
      program.set("Matrix4fv", { view: matrices.view, projection: matrices.projection });
    }
    this.line.set("2fv", { pixels: [width, height] });
    this.drawSurface(model, state, 0);
    const edge = this.look.edges[state.model] * matrices.unit;
    if (state.wire)
      this.drawLines(model, state, [{ lines: model.wire, ...this.look.lines, width: Math.min(this.look.lines.width * density, 0.12 * edge) }]);
    if (state.control && this.control)
      this.drawLines(this.control, state, [
        { lines: this.control.wire, ...this.look.control_lines, width: this.look.control_lines.width * density },
        { lines: this.control.dots, ...this.look.control_dots, width: this.look.control_dots.width * density },
      ]);
  }

  // Colors; or, with a lift, depths alone for lines of that width to lie on, pushed back as far as these need it.
  drawSurface(model, state, lift) {
    const gl = this.gl;
    gl.disable(gl.BLEND);
    gl.depthFunc(gl.LEQUAL);
    gl.useProgram(this.surface.program);
    this.surface.set("1i", { style: STYLES[state.style], perspective: state.parallel ? 0 : 1 });
    if (lift) {
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.colorMask(false, false, false, false);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(lift, 1);
    }
    model.drawSurface(state.flat);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.colorMask(true, true, true, true);
  }

  // Lines on a mesh: first what it hides of them, then what it does not.
  drawLines(model, state, strokes) {
    const gl = this.gl;
    this.drawSurface(model, state, Math.max(...strokes.map((stroke) => stroke.width / 2 + 1)));
    gl.useProgram(this.line.program);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const { lines, color, width, hidden } of strokes) {
      gl.bindVertexArray(lines.array);
      this.line.set("3fv", { line_color: color });
      for (const [test, opacity] of [[gl.GREATER, hidden], [gl.LEQUAL, 1]]) {
        if (!opacity) continue;
        gl.depthFunc(test);
        this.line.set("1f", { width, opacity });
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count);
      }
    }
    gl.depthMask(true);
  }
}
