// What the viewer uses of three.js: the rest is left out of the bundle.
export {
    AmbientLight, BackSide, Box3, BoxGeometry, BufferAttribute, BufferGeometry, Color, Data3DTexture, DataTexture, DataUtils,
    DirectionalLight, DoubleSide, EdgesGeometry, GLSL3, Group, HalfFloatType, LinearFilter, LineBasicMaterial, LineSegments, Mesh,
    MeshLambertMaterial, PerspectiveCamera, Points, PointsMaterial, Raycaster, RedFormat, Scene, ShaderMaterial, Vector2, Vector3,
    WebGLRenderer,
} from 'three';
export { LineMaterial } from 'three/addons/lines/LineMaterial.js';
export { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
export { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
