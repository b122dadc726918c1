//! A small rasteriser: shapes given by their signed distance, edges smoothed over one pixel.

/// A point in pixels, x to the right, y down.
pub(super) type Pixel = [f32; 2];

/// Red, green, blue in 0..=255.
pub(super) type Colour = [f32; 3];

/// A picture of floats, to be blended onto.
pub(super) struct Canvas {
    size: usize,
    rgb: Vec<Colour>,
}

impl Canvas {
    /// A square of `size` pixels in one colour.
    pub fn new(size: usize, background: Colour) -> Canvas {
        Canvas { size, rgb: vec![background; size * size] }
    }

    /// The picture as bytes, rows from the top.
    pub fn bytes(&self) -> Vec<u8> {
        self.rgb.iter().flatten().map(|v| v.round().clamp(0.0, 255.0) as u8).collect()
    }

    /// Blends a colour onto one pixel.
    fn blend(&mut self, x: usize, y: usize, colour: Colour, alpha: f32) {
        let pixel = &mut self.rgb[y * self.size + x];
        for (old, new) in pixel.iter_mut().zip(colour) {
            *old += (new - *old) * alpha;
        }
    }

    /// Blends the shape with this signed distance (pixels, negative inside) within a box.
    pub fn fill(
        &mut self,
        [low, high]: [Pixel; 2],
        colour: Colour,
        alpha: f32,
        distance: impl Fn(Pixel) -> f32,
    ) {
        // A cast of a float saturates, so that boxes outside the picture become empty ones.
        let from = low.map(|v| (v - 1.0).floor() as usize);
        let to = high.map(|v| ((v + 2.0).ceil() as usize).min(self.size));
        for y in from[1]..to[1] {
            for x in from[0]..to[0] {
                let cover = (0.5 - distance([x as f32 + 0.5, y as f32 + 0.5])).clamp(0.0, 1.0);
                if cover > 0.0 {
                    self.blend(x, y, colour, alpha * cover);
                }
            }
        }
    }

    /// A disc.
    pub fn disc(&mut self, centre: Pixel, radius: f32, colour: Colour, alpha: f32) {
        let around = [centre.map(|v| v - radius), centre.map(|v| v + radius)];
        self.fill(around, colour, alpha, |p| length(sub(p, centre)) - radius);
    }

    /// A circle's line.
    pub fn ring(&mut self, centre: Pixel, radius: f32, width: f32, colour: Colour, alpha: f32) {
        let outer = radius + width;
        let around = [centre.map(|v| v - outer), centre.map(|v| v + outer)];
        self.fill(around, colour, alpha, |p| (length(sub(p, centre)) - radius).abs() - 0.5 * width);
    }

    /// A line with round ends.
    pub fn line(&mut self, a: Pixel, b: Pixel, width: f32, colour: Colour, alpha: f32) {
        let half = 0.5 * width;
        let along = sub(b, a);
        let squared = dot(along, along).max(1e-6);
        self.fill(bounds(&[a, b], half), colour, alpha, |p| {
            let from_a = sub(p, a);
            let t = (dot(from_a, along) / squared).clamp(0.0, 1.0);
            length(sub(from_a, along.map(|v| v * t))) - half
        });
    }

    /// A convex polygon, its corners clockwise as seen on the picture.
    pub fn polygon(&mut self, corners: &[Pixel], colour: Colour, alpha: f32) {
        self.fill(bounds(corners, 0.0), colour, alpha, |p| {
            let edges = corners.iter().zip(corners.iter().cycle().skip(1));
            edges.fold(f32::MIN, |far, (&a, &b)| {
                let (edge, to) = (sub(b, a), sub(p, a));
                far.max((edge[1] * to[0] - edge[0] * to[1]) / length(edge).max(1e-6))
            })
        });
    }

    /// The head of an arrow from `a` to `b`, a filled triangle with its tip at `b`.
    pub fn head(&mut self, a: Pixel, b: Pixel, size: f32, colour: Colour, alpha: f32) {
        let way = sub(b, a);
        let long = length(way);
        if long < 1e-3 {
            return;
        }
        let along = way.map(|v| v / long);
        // Short arrows are all head.
        let size = size.min(long);
        let neck = sub(b, along.map(|v| v * size));
        let side = [-along[1] * 0.45 * size, along[0] * 0.45 * size];
        self.polygon(&[b, add(neck, side), sub(neck, side)], colour, alpha);
    }

    /// Text of the characters `0123456789 m`, `scale` pixels a dot, from its upper left corner.
    pub fn text(&mut self, at: Pixel, text: &str, scale: f32, colour: Colour) {
        for (i, rows) in text.chars().map(glyph).enumerate() {
            let left = at[0] + 6.0 * scale * i as f32;
            for dot in (0..35).filter(|d| rows[d / 5] >> (4 - d % 5) & 1 == 1) {
                let corner = [left + (dot % 5) as f32 * scale, at[1] + (dot / 5) as f32 * scale];
                let half = 0.5 * scale;
                self.disc(corner.map(|v| v + half), 0.62 * scale, colour, 1.0);
            }
        }
    }
}

/// Dots of a character, five to a row, the leftmost the highest bit.
fn glyph(c: char) -> [u8; 7] {
    match c {
        '0' => [14, 17, 17, 17, 17, 17, 14],
        '1' => [4, 12, 4, 4, 4, 4, 14],
        '2' => [14, 17, 1, 2, 4, 8, 31],
        '3' => [14, 17, 1, 6, 1, 17, 14],
        '4' => [2, 6, 10, 18, 31, 2, 2],
        '5' => [31, 16, 30, 1, 1, 17, 14],
        '6' => [14, 16, 16, 30, 17, 17, 14],
        '7' => [31, 1, 2, 4, 4, 8, 8],
        '8' => [14, 17, 17, 14, 17, 17, 14],
        '9' => [14, 17, 17, 15, 1, 1, 14],
        'm' => [0, 0, 26, 21, 21, 21, 21],
        _ => [0; 7],
    }
}

/// The box around points, wider by `margin`.
fn bounds(points: &[Pixel], margin: f32) -> [Pixel; 2] {
    let fold = |start: f32, f: fn(f32, f32) -> f32| {
        [0, 1].map(|axis| points.iter().fold(start, |v, p| f(v, p[axis])))
    };
    let (low, high) = (fold(f32::MAX, f32::min), fold(f32::MIN, f32::max));
    [low.map(|v| v - margin), high.map(|v| v + margin)]
}

fn add(a: Pixel, b: Pixel) -> Pixel {
    [a[0] + b[0], a[1] + b[1]]
}

fn sub(a: Pixel, b: Pixel) -> Pixel {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Pixel, b: Pixel) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: Pixel) -> f32 {
    a[0].hypot(a[1])
}
