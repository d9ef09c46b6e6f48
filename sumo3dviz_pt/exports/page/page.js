// Shows an exported scene: looks around, walks, plays the traffic, rides along.
// It needs three.js (three.js beside it) and the scene (scene.js), and no server.
"use strict";

(async () => {
  const $ = (id) => document.getElementById(id);
  const fail = (words) => { $("said").hidden = false; $("said").textContent = words; };
  if (!window.DecompressionStream) {
    fail("This browser is too old for the page: Firefox 113, Chrome 80, Safari 16.4 or newer.");
    return;
  }

  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  }

  // The picture.
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  } catch (error) {
    fail("This browser shows no WebGL: switch hardware acceleration on, or take another one.");
    return;
  }
  renderer.outputEncoding = THREE.sRGBEncoding;
  renderer.toneMapping = THREE.ACESFilmicToneMapping;
  renderer.toneMappingExposure = SCENE.dark ? 1.4 : 0.6;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFSoftShadowMap;
  document.body.prepend(renderer.domElement);
  const scene = new THREE.Scene();
  const eye = new THREE.PerspectiveCamera(50, 1, 0.15, 6000);
  const dark = SCENE.dark, sunny = SCENE.sun !== null;
  const air = new THREE.Color(dark ? 0x1a2233 : 0xb4c8da);
  const zenith = new THREE.Color(dark ? 0x0c1222 : 0x4d7fbd);
  const ground = new THREE.Color(dark ? 0x0a0a0a : 0x6a675f);
  scene.fog = new THREE.Fog(air, 300, 3500);
  const dome = new THREE.Mesh(new THREE.SphereGeometry(5000, 32, 24), new THREE.ShaderMaterial({
    side: THREE.BackSide, depthWrite: false, fog: false,
    uniforms: { air: { value: air }, zenith: { value: zenith }, ground: { value: ground } },
    vertexShader: "varying vec3 way; void main() { way = position;"
      + " gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
    fragmentShader: "varying vec3 way; uniform vec3 air, zenith, ground; void main() {"
      + " float up = normalize(way).y;"
      + " vec3 sky = mix(air, zenith, pow(clamp(up, 0.0, 1.0), 0.5));"
      + " gl_FragColor = vec4(mix(ground, sky, smoothstep(-0.03, 0.0, up)), 1.0);"
      + " \n#include <tonemapping_fragment>\n#include <encodings_fragment>\n }",
  }));
  // What is smooth mirrors the sky, and everything is lit by it.
  const around = new THREE.Scene();
  around.add(dome);
  scene.environment = new THREE.PMREMGenerator(renderer).fromScene(around, 0, 1, 6000).texture;
  scene.add(dome);
  const sun = new THREE.DirectionalLight(0xfff0dc, 2.3);
  const reach = 90;  // half the width of what has shadows, in metres
  if (sunny) {
    sun.castShadow = true;
    sun.shadow.mapSize.set(4096, 4096);
    Object.assign(sun.shadow.camera,
      { left: -reach, right: reach, top: reach, bottom: -reach, near: 1, far: 900 });
    sun.shadow.camera.updateProjectionMatrix();
    sun.shadow.bias = -0.0002;
    sun.shadow.normalBias = 0.04;
    scene.add(sun, sun.target);
  }

  // The scene.
  const data = await unpacked(SCENE.gltf);
  const loaded = await new Promise((done, wrong) => {
    new THREE.GLTFLoader().parse(data, "", done, wrong);
  });
  scene.add(loaded.scene);
  const comes = [];  // what has no size while it is away
  loaded.scene.traverse((node) => {
    if (node.isLight) { node.visible = false; }
    if (node.isMesh) {
      // What is flat has no normals; shadows ask for some, though flat shading does not.
      if (!node.geometry.attributes.normal) { node.geometry.computeVertexNormals(); }
      node.castShadow = true;
      node.receiveShadow = true;
      const map = node.material.map;
      if (map) { map.anisotropy = renderer.capabilities.getMaxAnisotropy(); }
    }
  });
  for (const clip of loaded.animations) {
    for (const track of clip.tracks) {
      const dot = track.name.lastIndexOf("."), name = track.name.slice(0, dot);
      if (track.name.slice(dot) === ".scale") {
        comes.push(loaded.scene.getObjectByProperty("uuid", name)
          || loaded.scene.getObjectByName(name));
      }
    }
  }
  const mixer = new THREE.AnimationMixer(loaded.scene);
  for (const clip of loaded.animations) { mixer.clipAction(clip).play(); }
  const lasts = Math.max(SCENE.end - SCENE.start, 0);

  // Views.
  const cameras = [];
  loaded.scene.traverse((node) => { if (node.isCamera) { cameras.push(node); } });
  cameras.sort((a, b) => SCENE.cameras.indexOf(nameOf(a)) - SCENE.cameras.indexOf(nameOf(b)));
  function nameOf(camera) { return (camera.userData.camera || camera.parent.userData.camera || camera.name); }
  const ridesOf = (camera) => (camera.userData.rides || camera.parent.userData.rides || "");
  cameras.forEach((camera, index) => $("camera").add(new Option(nameOf(camera), index)));
  $("camera").add(new Option("free", -1));
  let ridden = [];
  function ride(index) {
    ridden.forEach((node) => { node.userData.hidden = false; });
    ridden = [];
    const id = index < 0 ? "" : ridesOf(cameras[index]);
    if (id) {
      loaded.scene.traverse((node) => { if (node.userData.thing === id) { ridden.push(node); } });
    }
    ridden.forEach((node) => { node.userData.hidden = true; });
  }
  let chosen = cameras.length ? 0 : -1;
  if (chosen < 0) {
    eye.position.set(0, 30, 60);
    eye.lookAt(0, 0, 0);
  }
  ride(chosen);
  $("camera").value = chosen;
  $("camera").onchange = () => { chosen = Number($("camera").value); ride(chosen); };

  // Walking.
  const keys = new Set();
  const turn = new THREE.Euler(0, 0, 0, "YXZ");
  function leave() {
    if (chosen < 0) { return; }
    chosen = -1;
    ride(-1);
    $("camera").value = -1;
  }
  let from = null;
  renderer.domElement.onpointerdown = (event) => {
    from = [event.clientX, event.clientY];
    renderer.domElement.setPointerCapture(event.pointerId);
  };
  renderer.domElement.onpointerup = () => { from = null; };
  renderer.domElement.onpointermove = (event) => {
    if (!from) { return; }
    leave();
    turn.setFromQuaternion(eye.quaternion);
    const scale = eye.fov * Math.PI / 180 / window.innerHeight;
    turn.y += (event.clientX - from[0]) * scale;
    turn.x = Math.max(-1.5, Math.min(1.5, turn.x + (event.clientY - from[1]) * scale));
    turn.z = 0;
    eye.quaternion.setFromEuler(turn);
    from = [event.clientX, event.clientY];
  };
  renderer.domElement.onwheel = (event) => {
    event.preventDefault();
    leave();
    eye.translateZ(event.deltaY * 0.02);
  };
  window.onkeydown = (event) => { keys.add(event.key.toLowerCase()); };
  window.onkeyup = (event) => { keys.delete(event.key.toLowerCase()); };
  function walk(seconds) {
    const step = (keys.has("shift") ? 30 : 8) * seconds;
    const moves = { w: ["z", -1], s: ["z", 1], a: ["x", -1], d: ["x", 1], e: ["y", 1], q: ["y", -1] };
    for (const [key, [axis, sign]] of Object.entries(moves)) {
      if (keys.has(key)) { leave(); eye[`translate${axis.toUpperCase()}`](sign * step); }
    }
  }

  // Time.
  let now = 0, playing = lasts > 0, before = performance.now();
  const asked = Number(new URLSearchParams(location.search).get("at") || NaN);
  if (!Number.isNaN(asked)) { now = Math.min(Math.max(asked - SCENE.start, 0), lasts); playing = false; }
  $("play").onclick = () => { playing = !playing; };
  $("when").oninput = () => { playing = false; now = lasts * $("when").value / 1000; };
  if (!lasts) { $("play").hidden = true; $("when").hidden = true; }

  function fit() {
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(window.innerWidth, window.innerHeight);
    eye.aspect = window.innerWidth / window.innerHeight;
  }
  window.onresize = fit;
  fit();
  const scale = new THREE.Vector3(), ahead = new THREE.Vector3();
  function frame(clock) {
    const seconds = Math.min((clock - before) / 1000, 0.1);
    before = clock;
    if (playing && lasts) { now = (now + seconds) % lasts; }
    mixer.setTime(Math.min(now, lasts - 1e-4 > 0 ? lasts - 1e-4 : 0));
    comes.forEach((node) => { if (node) { node.visible = node.scale.x !== 0; } });
    ridden.forEach((node) => { node.visible = false; });
    walk(seconds);
    if (chosen >= 0) {
      const camera = cameras[chosen];
      camera.updateWorldMatrix(true, false);
      camera.matrixWorld.decompose(eye.position, eye.quaternion, scale);
      const across = 2 * Math.atan(Math.tan(camera.fov * Math.PI / 360) * camera.aspect);
      eye.fov = 2 * Math.atan(Math.tan(across / 2) / eye.aspect) * 180 / Math.PI;
    }
    eye.updateProjectionMatrix();
    dome.position.copy(eye.position);
    if (sunny) {
      eye.getWorldDirection(ahead);
      sun.target.position.copy(eye.position).addScaledVector(ahead.setY(0).normalize(), 0.7 * reach);
      sun.target.position.y = eye.position.y - 10;
      sun.position.copy(sun.target.position).addScaledVector(
        new THREE.Vector3(...SCENE.sun), 400);
    }
    renderer.render(scene, eye);
    $("play").textContent = playing ? "pause" : "play";
    $("time").textContent = `${(SCENE.start + now).toFixed(1)} s`;
    if (document.activeElement !== $("when") || playing) { $("when").value = lasts ? 1000 * now / lasts : 0; }
    requestAnimationFrame(frame);
  }
  $("said").hidden = true;
  $("bar").hidden = false;
  requestAnimationFrame((clock) => { frame(clock); document.body.dataset.ready = "yes"; });
})().catch((error) => {
  const said = document.getElementById("said");
  said.hidden = false;
  said.textContent = `The scene cannot be shown: ${error.message || error}`;
});
