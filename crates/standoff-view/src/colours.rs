//! Colours of UAVs and groups, the same in figures, on the page and in an MCAP file.

use plotters::style::RGBColor;
use standoff_sim::record::GroupRow;
use std::collections::BTreeMap;

/// For UAVs by rank: colours of Okabe and Ito, then darker ones, which colour-blind readers can tell apart.
/// `page/palette.js` has the same, and their like for a dark page.
pub(crate) const UAVS: [RGBColor; 12] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(73, 0, 146),
    RGBColor(146, 73, 0),
    RGBColor(0, 109, 109),
    RGBColor(182, 109, 255),
    RGBColor(136, 17, 51),
    RGBColor(153, 136, 102),
    RGBColor(51, 68, 102),
    RGBColor(68, 119, 68),
];
/// For groups: none of the UAVs' colours, and lighter.
pub(crate) const GROUPS: [RGBColor; 5] = [
    RGBColor(0, 158, 115),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(153, 204, 119),
    RGBColor(238, 102, 119),
];

/// Which of the colours each group has, while it lasts.
#[derive(Debug, Default)]
pub(crate) struct GroupColours {
    alive: BTreeMap<u32, usize>,
    /// How often each colour was given.
    given: [usize; GROUPS.len()],
}

impl GroupColours {
    /// Takes in the groups of the next instant: each that is new gets the colour that the fewest of those alive have, and
    /// of these colours the one that was given least often.
    pub(crate) fn next_instant(&mut self, groups: &[GroupRow]) {
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

    /// The place of a group's colour in [`GROUPS`], if the group was there at the last instant.
    pub(crate) fn place(&self, group: u32) -> Option<usize> {
        self.alive.get(&group).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_uavs_or_groups_have_one_colour_and_the_page_has_the_same_for_uavs() {
        let all: Vec<&RGBColor> = UAVS.iter().chain(&GROUPS).collect();
        assert!((1..all.len()).all(|rank| !all[..rank].contains(&all[rank])));
        let page = include_str!("../page/palette.js");
        let light = page.split("uavs: [").nth(1).and_then(|rest| rest.split(']').next()).unwrap();
        let light: Vec<&str> = light.split('"').filter(|word| word.starts_with('#')).collect();
        assert_eq!(light, UAVS.map(|RGBColor(r, g, b)| format!("#{r:02x}{g:02x}{b:02x}")));
    }

    #[test]
    fn a_new_group_takes_no_colour_of_one_that_lives() {
        let mut colours = GroupColours::default();
        let row = |group| GroupRow { group, ..crate::figures::tests::group() };
        let mut places = |groups: &[u32]| {
            let rows: Vec<GroupRow> = groups.iter().copied().map(row).collect();
            colours.next_instant(&rows);
            groups.iter().map(|id| colours.place(*id).unwrap()).collect::<Vec<_>>()
        };
        assert_eq!(places(&[0, 1, 2]), [0, 1, 2]);
        assert_eq!(places(&[0, 3]), [0, 3]);
        assert_eq!(places(&[0, 4]), [0, 4]);
        // By its number, group 5 would look like group 0.
        assert_eq!(places(&[0, 5]), [0, 1]);
    }
}
