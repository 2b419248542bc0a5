#version 330 core
// A surface in eye coordinates.

uniform mat4 view;
uniform mat4 projection;

in vec3 in_position;
in vec3 in_normal;
in float in_value;

out vec3 position;
out vec3 normal;
out vec3 world_normal;
out float value;

void main() {
    vec4 seen = view * vec4(in_position, 1.0);
    position = seen.xyz;
    normal = mat3(view) * in_normal;
    world_normal = in_normal;
    value = in_value;
    gl_Position = projection * seen;
}
