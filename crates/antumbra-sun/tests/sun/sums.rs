//! Sums of bits, against sums bit by bit.

use antumbra_sun::{Bits, Groups, Study, Sun, SunKind, Time, sums, sunlit_shares, totals};

use crate::support::about;

/// A study of random bits, in runs as those of real days are.
fn random(sun_count: usize, sensor_count: usize, is_even: bool) -> Study {
    // SplitMix64.
    let mut state = sun_count as u64;
    let mut random = move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    };
    let mut local = 0;
    let mut suns = Vec::new();
    let mut directions = Vec::new();
    for number in 0..sun_count {
        let weight = if is_even {
            600.0
        } else {
            (600 + 60 * (random() % 3)) as f64
        };
        local += if random() % 10 == 0 {
            5000
        } else {
            weight as i64
        };
        suns.push(Sun {
            azimuth: 180.0,
            elevation: 45.0,
            weight,
            time: Some(Time {
                local,
                offset_minutes: 0,
            }),
            direct_normal: (number % 7 > 0).then_some((random() % 900) as f64),
        });
        let [x, y] = [0, 0].map(|_| (random() % 1000) as f64 / 2000.0);
        directions.push([x, y, (1.0 - x * x - y * y).sqrt()]);
    }
    let stride = sun_count.div_ceil(64);
    let mut words = vec![0_u64; stride * sensor_count];
    for sensor in 1..sensor_count {
        let mut is_sunlit = false;
        for sun in 0..sun_count {
            is_sunlit ^= random() % 8 == 0;
            // One sensor sees all suns, and the first none.
            let bit = u64::from(is_sunlit || sensor == 1);
            words[sensor * stride + sun / 64] |= bit << (sun % 64);
        }
    }
    let mut about = about(SunKind::Suns);
    about.has_weather = true;
    Study {
        about,
        points: vec![[0.0; 3]; sensor_count],
        normals: Some(vec![[0.0, 0.0, 1.0]; sensor_count]),
        surfaces: None,
        areas: None,
        suns,
        directions,
        bits: Bits { stride, words },
        shares: None,
        sky_view_factor: None,
    }
}

#[test]
fn sums_are_those_of_single_bits() {
    for (sun_count, is_even) in [
        (1, true),
        (63, false),
        (64, true),
        (65, false),
        (1000, true),
        (1003, false),
    ] {
        // More sensors than a thread takes at a time.
        let study = random(sun_count, 1100, is_even);
        let found = sums(&study);
        let (hours, longest) = (found.hours.unwrap(), found.longest.unwrap());
        let (first, last) = (found.first.unwrap(), found.last.unwrap());
        let irradiation = found.irradiation.unwrap();
        for sensor in 0..study.points.len() {
            let (mut seconds, mut energy, mut span, mut most) = (0.0, 0.0, 0.0, 0.0_f64);
            let mut ends = [-1, -1];
            for (place, sun) in study.suns.iter().enumerate() {
                if !study.bits.is_sunlit(sensor, place) {
                    span = 0.0;
                    continue;
                }
                let goes_on = place > 0 && {
                    let before = &study.suns[place - 1];
                    let [time, earlier] = [sun, before].map(|sun| sun.time.unwrap());
                    let step = (sun.weight + before.weight) / 2.0 + 1.0;
                    (time.local - earlier.local) as f64 <= step && time.day() == earlier.day()
                };
                span = if goes_on { span } else { 0.0 } + sun.weight;
                most = most.max(span);
                seconds += sun.weight;
                energy +=
                    sun.direct_normal.unwrap_or(0.0) * study.directions[place][2] * sun.weight;
                ends[1] = place as i32;
                if ends[0] < 0 {
                    ends[0] = place as i32;
                }
            }
            let of = format!("sensor {sensor} of {sun_count} suns");
            assert_eq!(hours[sensor], seconds / 3600.0, "{of}");
            assert_eq!(longest[sensor], most / 3600.0, "{of}");
            assert_eq!([first[sensor], last[sensor]], ends, "{of}");
            let expected = energy / 3.6e6;
            assert!(
                (irradiation[sensor] - expected).abs() <= 1e-12 * expected,
                "{of}"
            );
        }
    }
}

#[test]
fn groups_share_what_their_sensors_have_by_area() {
    let mut study = random(150, 40, false);
    study.areas = Some((0..40).map(|sensor| 1.0 + f64::from(sensor % 4)).collect());
    let areas = study.areas.clone().unwrap();
    let groups = Groups {
        names: ["a", "none", "b"].map(str::to_owned).into(),
        of: (0..40).map(|sensor| 2 * (sensor % 2)).collect(),
    };
    let of_group = |group: u32| (0..40).filter(move |&sensor| 2 * (sensor as u32 % 2) == group);
    let shares = sunlit_shares(&study, &groups, 70..140);
    assert_eq!(shares.len(), 70 * 3);
    for (place, &share) in shares.iter().enumerate() {
        let (sun, group) = (70 + place / 3, (place % 3) as u32);
        let lit = |&sensor: &usize| study.bits.is_sunlit(sensor, sun);
        let area = |sensors: &mut dyn Iterator<Item = usize>| {
            sensors.map(|sensor| areas[sensor]).sum::<f64>()
        };
        let due = match group {
            1 => 0.0,
            _ => area(&mut of_group(group).filter(lit)) / area(&mut of_group(group)),
        };
        assert!((share - due).abs() < 1e-12, "{sun} {group}: {share} {due}");
        assert!((0.0..=1.0).contains(&share));
    }
    let numbers = sums(&study);
    let hours = numbers.hours.as_ref().unwrap();
    let found = totals(&study, &numbers, &groups);
    assert_eq!((found[1].sensors, found[1].hours), (0, None));
    for group in [0, 2] {
        let total = found[group as usize];
        let spread = total.hours.unwrap();
        let area: f64 = of_group(group).map(|sensor| areas[sensor]).sum();
        let sum: f64 = of_group(group)
            .map(|sensor| areas[sensor] * hours[sensor])
            .sum();
        assert_eq!((total.sensors, total.area), (20, area));
        assert!((spread.mean - sum / area).abs() < 1e-9);
        let least = of_group(group)
            .map(|sensor| hours[sensor])
            .fold(f64::INFINITY, f64::min);
        let most = of_group(group)
            .map(|sensor| hours[sensor])
            .fold(0.0, f64::max);
        assert_eq!((spread.least, spread.most), (least, most));
    }
}
