//! The page: panels side by side above one legend.

use crate::canvas::{Align, Canvas, PictureError};
use crate::colours::{INK, MUTED, PAPER};
use crate::panel::PanelView;
use crate::scene::{Look, Panel};
use crate::{legend, text};

/// Margin around the page, units.
const MARGIN: f32 = 14.0;
/// Space between panels, units.
const GAP: f32 = 28.0;
/// Height of a panel's title, units.
const TITLE: f32 = 30.0;
/// Font sizes of a title and of a note, units.
const TITLE_SIZE: f32 = 16.0;
const NOTE_SIZE: f32 = 13.0;

/// Draws panels side by side above one legend.
///
/// # Errors
/// If `half_extent_m` or `cell_m` is not positive and finite, or the picture has no pixels or more
/// than 16,384 in a row or column.
pub fn birds_eye(panels: &[Panel], look: &Look) -> Result<Canvas, PictureError> {
    for metres in [look.half_extent_m, look.cell_m] {
        if !(metres > 0.0 && metres.is_finite()) {
            return Err(PictureError::Extent(metres));
        }
    }
    let n = panels.len().max(1) as f32;
    let width = look.side * n + GAP * (n - 1.0);
    let rows = legend::rows(look, width);
    let height = TITLE + look.side + legend::height(&rows);
    let page = [width, height].map(|v| v + 2.0 * MARGIN);
    let mut canvas = Canvas::new(page, look.scale, PAPER)?;
    for (i, panel) in panels.iter().enumerate() {
        let left = MARGIN + i as f32 * (look.side + GAP);
        draw_title(&mut canvas, panel, [left, MARGIN + TITLE - 11.0], look.side);
        canvas.place(&PanelView::new(look).draw(panel)?, [left, MARGIN + TITLE]);
    }
    legend::draw(&mut canvas, &rows, look, [MARGIN, MARGIN + TITLE + look.side]);
    Ok(canvas)
}

/// Draws title and note on one baseline; the title is cut to end before the note.
fn draw_title(canvas: &mut Canvas, panel: &Panel, [left, y]: [f32; 2], wide: f32) {
    let room = wide - text::width(&panel.note, NOTE_SIZE) - GAP;
    let fits = |title: &String| text::width(title, TITLE_SIZE) <= room;
    let cut = |end| format!("{}…", panel.title[..end].trim_end());
    let ends = panel.title.char_indices().rev().map(|(end, _)| end);
    let title = Some(panel.title.clone()).into_iter().chain(ends.map(cut)).find(fits);
    let title = title.unwrap_or_default();
    canvas.text([left, y], &title, TITLE_SIZE, Align::Start, INK);
    canvas.text([left + wide, y], &panel.note, NOTE_SIZE, Align::End, MUTED);
}
