"""Draw a BVH file of the standard skeleton as an animated GIF, or one frame as a PNG.

python tools/render_motion.py out.bvh docs/pictures/demo.gif --start 8 --seconds 6
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from lobstr_hw.bvh import read_bvh
from lobstr_hw.rotations import Array, rotation_x, rotation_y
from lobstr_hw.skeleton import HUMANOID_NAMES, PARENTS, TOE_TIP, Joint

SKY, GRID, SHADOW = (246, 247, 250), (222, 225, 232), (206, 210, 220)
TRACKED, PREDICTED, DOT = (58, 82, 140), (214, 96, 40), (20, 24, 40)
LEGS = range(Joint.LEFT_UPPER_LEG, Joint.RIGHT_TOES + 1)
TRACKERS = (Joint.HEAD, Joint.LEFT_HAND, Joint.RIGHT_HAND, Joint.HIPS)
THICKNESS_M = {Joint.SPINE: 0.17, Joint.CHEST: 0.17, Joint.UPPER_CHEST: 0.18, Joint.NECK: 0.10}
FINE = 2  # drawn this much larger, then scaled down: smooth edges


class Camera:
    """Looks at a point from a little above; orthographic."""

    def __init__(self, target: Array, size: tuple[int, int], yaw_deg: float, span_m: float) -> None:
        self.R = rotation_x(np.radians(14.0)) @ rotation_y(np.radians(yaw_deg))
        self.target, self.size, self.scale = target, size, FINE * size[1] / span_m

    def to_pixels(self, p: Array) -> Array:
        """World (..., 3) -> x, y in pixels and depth, near is large."""
        q = ((p - self.target) @ self.R.T) * self.scale
        x = q[..., 0] + FINE * self.size[0] / 2
        return np.stack([x, FINE * self.size[1] / 2 - q[..., 1], q[..., 2]], axis=-1)


def draw_floor(draw: ImageDraw.ImageDraw, camera: Camera) -> None:
    centre = np.round(camera.target * [1, 0, 1])
    for k in np.arange(-4.0, 4.5, 0.5):
        for ends in ([[k, 0, -4], [k, 0, 4]], [[-4, 0, k], [4, 0, k]]):
            a, b = camera.to_pixels(centre + np.array(ends))
            draw.line([tuple(a[:2]), tuple(b[:2])], fill=GRID, width=FINE)


def capsule(draw: ImageDraw.ImageDraw, a: Array, b: Array, width: float, colour: tuple) -> None:
    draw.line([tuple(a[:2]), tuple(b[:2])], fill=colour, width=int(width))
    for x, y in (a[:2], b[:2]):
        r = width / 2
        draw.ellipse([x - r, y - r, x + r, y + r], fill=colour)


def bones(p: Array, R: Array) -> list[tuple[Array, Array, float, tuple]]:
    """Ends in the world, thickness in metres and colour of everything that is drawn."""
    out = []
    for joint, parent in enumerate(PARENTS[1:], start=1):
        colour = PREDICTED if joint in LEGS else TRACKED
        out.append((p[parent], p[joint], THICKNESS_M.get(Joint(joint), 0.085), colour))
    for toes in (Joint.LEFT_TOES, Joint.RIGHT_TOES):
        out.append((p[toes], p[toes] + R[toes] @ TOE_TIP, 0.07, PREDICTED))
    skull = [p[Joint.HEAD] + R[Joint.HEAD] @ np.array([0.0, y, 0.03]) for y in (0.06, 0.12)]
    out.append((skull[0], skull[1], 0.19, TRACKED))
    return out


def picture(p: Array, R: Array, camera: Camera) -> Image.Image:
    image = Image.new("RGB", (FINE * camera.size[0], FINE * camera.size[1]), SKY)
    draw = ImageDraw.Draw(image)
    draw_floor(draw, camera)
    parts = bones(p, R)
    for a, b, thick, _ in parts:
        flat = [camera.to_pixels(x * [1, 0, 1]) for x in (a, b)]
        capsule(draw, *flat, thick * camera.scale, SHADOW)
    for a, b, thick, colour in sorted(parts, key=lambda x: float(((x[0] + x[1]) @ camera.R.T)[2])):
        capsule(draw, camera.to_pixels(a), camera.to_pixels(b), thick * camera.scale, colour)
    for joint in TRACKERS:
        x, y, _ = camera.to_pixels(p[joint])
        r = 0.028 * camera.scale
        draw.ellipse([x - r, y - r, x + r, y + r], fill=DOT, outline=(255, 255, 255), width=FINE)
    return image.resize(camera.size, Image.Resampling.LANCZOS)


def read_body(path: Path) -> tuple[Array, Array, float]:
    """Positions in metres, rotations and frame time, joints in the standard order."""
    bvh = read_bvh(path)
    p, R = bvh.world()
    order = [bvh.names.index(name) for name in HUMANOID_NAMES]
    return p[:, order] * 0.01, R[:, order], bvh.frame_time_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("bvh", type=Path)
    parser.add_argument("out", type=Path, help=".gif or .png")
    parser.add_argument("--start", type=float, default=0.0, help="seconds")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--fps", type=float, default=15.0)
    parser.add_argument("--size", type=int, nargs=2, default=(480, 360))
    parser.add_argument("--yaw", type=float, default=-35.0, help="degrees the scene is turned")
    parser.add_argument("--span", type=float, default=2.3, help="metres from top to bottom")
    args = parser.parse_args()
    p, R, frame_time_s = read_body(args.bvh)
    count = 1 if args.out.suffix == ".png" else int(args.seconds * args.fps)
    frames = ((args.start + np.arange(count) / args.fps) / frame_time_s).astype(int)
    frames = frames[frames < len(p)]
    middle = p[frames, Joint.HIPS].mean(axis=0)
    images = []
    for i in frames:
        target = 0.7 * p[i, Joint.HIPS] + 0.3 * middle  # the camera follows, softly
        target = np.array([target[0], 0.85, target[2]])
        images.append(picture(p[i], R[i], Camera(target, tuple(args.size), args.yaw, args.span)))
    if args.out.suffix == ".png":
        images[0].save(args.out, optimize=True)
        return
    palette = images[0].quantize(48)
    frames_out = [im.quantize(palette=palette, dither=Image.Dither.NONE) for im in images]
    frames_out[0].save(
        args.out,
        save_all=True,
        append_images=frames_out[1:],
        loop=0,
        duration=int(1000 / args.fps),
        optimize=True,
    )


if __name__ == "__main__":
    main()
