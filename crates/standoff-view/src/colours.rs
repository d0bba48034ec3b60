//! Colours of UAVs and groups, identical in figures, on the page and in MCAP files (`python/standoff/mcap.py`).

use plotters::style::RGBColor;
use standoff_record::GroupRow;
use std::collections::BTreeMap;

/// Colours of UAVs by rank, blue to purple. `page/palette.js` has the same colours for light and dark pages: all have
/// a contrast of at least 3.5 with white and with black. A higher one leaves too little difference in lightness, by
/// which colour-blind users distinguish such colours. The colours of UAVs and groups were optimised numerically for a
/// large minimum colour difference, which is larger still among the first few UAVs.
pub(crate) const UAVS: [RGBColor; 8] = [
    RGBColor(190, 85, 255),
    RGBColor(185, 15, 140),
    RGBColor(90, 60, 255),
    RGBColor(70, 140, 215),
    RGBColor(135, 80, 175),
    RGBColor(175, 10, 210),
    RGBColor(235, 15, 210),
    RGBColor(65, 105, 145),
];
/// Colours of groups, orange to green, with a contrast of at least 3 with white and with black.
pub(crate) const GROUPS: [RGBColor; 8] = [
    RGBColor(205, 122, 6),
    RGBColor(4, 166, 136),
    RGBColor(133, 76, 47),
    RGBColor(0, 117, 1),
    RGBColor(72, 167, 21),
    RGBColor(143, 153, 79),
    RGBColor(59, 99, 72),
    RGBColor(129, 115, 53),
];

/// Assignment of colours to the existing groups.
#[derive(Debug, Default)]
pub(crate) struct GroupColours {
    alive: BTreeMap<u32, usize>,
    /// Number of times each colour has been assigned.
    given: [usize; GROUPS.len()],
}

impl GroupColours {
    /// Processes the groups of the next time step. A new group gets the colour that the fewest existing groups have;
    /// ties go to the colour that was assigned least often.
    pub(crate) fn next_step(&mut self, groups: &[GroupRow]) {
        self.alive.retain(|id, _| groups.iter().any(|row| row.group == *id));
        for id in groups.iter().map(|row| row.group) {
            if !self.alive.contains_key(&id) {
                let alive = |colour| self.alive.values().filter(|&&taken| taken == colour).count();
                let shares = |&colour: &usize| (alive(colour), self.given[colour]);
                let colour = (0..GROUPS.len()).min_by_key(shares).unwrap_or(0);
                self.given[colour] += 1;
                self.alive.insert(id, colour);
            }
        }
    }

    /// Index of a group's colour in [`GROUPS`], if the group existed at the last time step.
    pub(crate) fn place(&self, group: u32) -> Option<usize> {
        self.alive.get(&group).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::group_row;
    use standoff::math;

    /// Colour vision models as matrices in linear sRGB: normal vision, deuteranopia, protanopia (Machado, Oliveira and
    /// Fernandes 2009).
    const SIGHTS: [[[f64; 3]; 3]; 3] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    ];

    fn times(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|row| (0..3).map(|column| matrix[row][column] * vector[column]).sum())
    }

    fn linear(colour: &str) -> [f64; 3] {
        std::array::from_fn(|channel| {
            let value = f64::from(u8::from_str_radix(&colour[2 * channel + 1..2 * channel + 3], 16).unwrap()) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { math::exp(2.4 * math::ln((value + 0.055) / 1.055)) }
        })
    }

    /// Converts to Ottosson's OKLab: lightness, a and b, in hundredths.
    fn oklab(linear: [f64; 3]) -> [f64; 3] {
        const CONES: [[f64; 3]; 3] = [
            [0.412_221_470_8, 0.536_332_536_3, 0.051_445_992_9],
            [0.211_903_498_2, 0.680_699_545_1, 0.107_396_956_6],
            [0.088_302_461_9, 0.281_718_837_6, 0.629_978_700_5],
        ];
        const LAB: [[f64; 3]; 3] = [
            [0.210_454_255_3, 0.793_617_785_0, -0.004_072_046_8],
            [1.977_998_495_1, -2.428_592_205_0, 0.450_593_709_9],
            [0.025_904_037_1, 0.782_771_766_2, -0.808_675_766_0],
        ];
        times(&LAB, times(&CONES, linear.map(|value| value.clamp(0.0, 1.0))).map(f64::cbrt)).map(|value| 100.0 * value)
    }

    /// OKLab difference of two colours: the minimum over the given vision models.
    fn difference(a: &str, b: &str, sights: &[[[f64; 3]; 3]]) -> f64 {
        let seen = |sight, colour| oklab(times(sight, linear(colour)));
        let off = |sight| seen(sight, a).iter().zip(seen(sight, b)).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        sights.iter().map(|sight| off(sight).sqrt()).fold(f64::INFINITY, f64::min)
    }

    /// CIE 1976 difference of two colours in CIELAB (D65). About 2.3 is just noticeable between adjacent areas.
    fn lab_difference(sight: &[[f64; 3]; 3], a: &str, b: &str) -> f64 {
        const XYZ: [[f64; 3]; 3] = [
            [0.4124 / 0.95047, 0.3576 / 0.95047, 0.1805 / 0.95047],
            [0.2126, 0.7152, 0.0722],
            [0.0193 / 1.08883, 0.1192 / 1.08883, 0.9505 / 1.08883],
        ];
        let lab = |colour| {
            let [x, y, z] = times(&XYZ, times(sight, linear(colour)).map(|value| value.clamp(0.0, 1.0)))
                .map(|t: f64| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        };
        lab(a).iter().zip(lab(b)).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    }

    fn hue_deg(colour: &str) -> f64 {
        let [_, a, b] = oklab(linear(colour));
        math::atan2(b, a).to_degrees().rem_euclid(360.0)
    }

    /// Contrast ratio as defined by WCAG 2.
    fn contrast(a: &str, b: &str) -> f64 {
        let light = |colour| times(&[[0.2126, 0.7152, 0.0722]; 3], linear(colour))[0] + 0.05;
        let (a, b): (f64, f64) = (light(a), light(b));
        a.max(b) / a.min(b)
    }

    /// Reads the colours of UAVs or groups, or a colour of a theme, from the page.
    fn on_page(theme: &str, name: &str) -> Vec<String> {
        fn between<'a>(text: &'a str, start: &str, end: &str) -> &'a str {
            text.split(start).nth(1).and_then(|rest| rest.split(end).next()).unwrap()
        }
        let page = include_str!("../page/palette.js");
        let text = match name {
            "uavs" => between(page, "UAV_COLOURS = [", "]"),
            "groups" => between(page, "GROUP_COLOURS = [", "]"),
            _ => between(between(page, &format!("{theme}: {{"), "\n  },"), &format!(" {name}: "), ","),
        };
        text.split('"').filter(|word| word.starts_with('#')).map(str::to_owned).collect()
    }

    #[test]
    fn figures_page_and_mcap_files_use_the_same_colours() {
        let hex = |RGBColor(r, g, b): &RGBColor| format!("#{r:02x}{g:02x}{b:02x}");
        let page = include_str!("../page/palette.js");
        assert!(["uavs: UAV_COLOURS", "groups: GROUP_COLOURS"].iter().all(|list| page.matches(list).count() == 2));
        assert_eq!(on_page("light", "uavs"), UAVS.iter().map(hex).collect::<Vec<_>>());
        assert_eq!(on_page("light", "groups"), GROUPS.iter().map(hex).collect::<Vec<_>>());
        let mcap = include_str!("../../../python/standoff/mcap.py");
        let list = mcap.split("\nGROUPS = [").nth(1).and_then(|rest| rest.split(']').next()).unwrap();
        let in_mcap_files: Vec<_> = list.split('"').filter(|word| word.starts_with('#')).collect();
        assert_eq!(in_mcap_files, GROUPS.iter().map(hex).collect::<Vec<_>>());
    }

    /// Differences are in hundredths of OKLab. About two are just noticeable between adjacent areas.
    #[test]
    fn colours_of_uavs_groups_and_alarms_are_distinguishable() {
        for theme in ["light", "dark"] {
            let [uavs, groups, ground, alarm, none] =
                ["uavs", "groups", "ground", "alarm", "none"].map(|name| on_page(theme, name));
            let [ground, alarm, none] = [ground, alarm, none].map(|one| one[0].clone());
            assert!(uavs.iter().all(|uav| (220.0..352.0).contains(&hue_deg(uav))), "{theme}");
            assert!(groups.iter().all(|group| (45.0..175.0).contains(&hue_deg(group))), "{theme}");
            for colour in uavs.iter().chain(&groups) {
                assert!(contrast(colour, &ground) >= 3.0, "{theme}: {colour} on {ground}");
                assert!(difference(colour, &alarm, &SIGHTS[..1]) >= 12.0, "{theme}: {colour} and an alarm");
                assert!(difference(colour, &none, &SIGHTS[..1]) >= 8.0, "{theme}: {colour} and the colour of no group");
            }
            for uav in &uavs {
                assert!(contrast(uav, &ground) >= 3.5, "{theme}: {uav} on {ground}");
                for group in &groups {
                    assert!(difference(uav, group, &SIGHTS) >= 10.0, "{theme}: {uav} and {group}");
                }
            }
            for (kind, least) in [(&uavs, 9.5), (&groups, 10.5)] {
                for (rank, colour) in kind.iter().enumerate() {
                    for other in &kind[..rank] {
                        let least = if rank < 4 { 1.7 * least } else { least };
                        assert!(difference(colour, other, &SIGHTS[..1]) >= least, "{theme}: {colour} and {other}");
                        let seen = |sight| lab_difference(sight, colour, other);
                        assert!(SIGHTS[1..].iter().all(|sight| seen(sight) >= 10.0), "{theme}: {colour} and {other}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_new_group_gets_a_colour_that_no_existing_group_has() {
        let mut colours = GroupColours::default();
        let mut places = |groups: &[u32]| {
            let rows: Vec<GroupRow> = groups.iter().copied().map(group_row).collect();
            colours.next_step(&rows);
            groups.iter().map(|id| colours.place(*id).unwrap()).collect::<Vec<_>>()
        };
        assert_eq!(places(&[0, 1, 2]), [0, 1, 2]);
        assert_eq!(places(&[0, 3]), [0, 3]);
        assert_eq!(places(&[0, 4]), [0, 4]);
        for group in 5..8 {
            assert_eq!(places(&[0, group]), [0, group as usize]);
        }
        // With colours by group number, group 8 would have the colour of group 0.
        assert_eq!(places(&[0, 8]), [0, 1]);
    }
}
