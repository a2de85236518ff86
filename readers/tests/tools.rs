//! Headers as the tools write them that people use, and the map that comes of each.

use log_readers::{
    meaning::{Proposal, of_text},
    text::Table,
};

fn proposal(text: &str) -> Proposal {
    let table = Table::open(text.as_bytes(), &|_| false).unwrap();
    of_text(table.head(), &|_| false)
}

fn chosen(text: &str) -> Vec<String> {
    proposal(text).chosen.iter().map(ToString::to_string).collect()
}

/// The map of a header over two rows of ascending numbers.
fn of_header(header: &str, separator: char) -> Vec<String> {
    let count = header.split(separator).count();
    let row =
        |from: f64| (0..count).map(|i| (from + i as f64).to_string()).collect::<Vec<_>>().join(&separator.to_string());
    chosen(&format!("{header}\n{}\n{}\n{}\n", row(1.0), row(1.005), row(1.01)))
}

#[test]
fn euroc() {
    let imu = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]";
    let map = of_header(imu, ',');
    assert_eq!(map[0], "t_ns=timestamp [ns]");
    assert_eq!(map[1], "gyro_x=w_RS_S_x [rad s^-1]");
    assert_eq!(map[6], "accel_z=a_RS_S_z [m s^-2]");
    let vicon = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []";
    assert_eq!(
        of_header(vicon, ',')[1..],
        ["ref_qw=q_RS_w []", "ref_qx=q_RS_x []", "ref_qy=q_RS_y []", "ref_qz=q_RS_z []"]
    );
    let estimate = format!("{vicon},b_w_RS_S_x [rad s^-1],b_a_RS_S_x [m s^-2]");
    let found = proposal(&format!("{estimate}\n1,2,3,4,1,0,0,0,0,0\n2,2,3,4,1,0,0,0,0,0\n"));
    assert!(found.dependence("q_RS_w []").is_some_and(|by| by.contains("bias")), "{found:?}");
}

#[test]
fn a_unit_behind_the_last_of_three_is_that_of_all() {
    assert_eq!(
        of_header("t[ms]\tgyro X\tgyro Y\tgyro Z (deg/s)\tacc X\tacc Y\tacc Z (g)", '\t'),
        [
            "t_ms=t[ms]",
            "gyro_x_dps=gyro X",
            "gyro_y_dps=gyro Y",
            "gyro_z_dps=gyro Z (deg/s)",
            "accel_x_g=acc X",
            "accel_y_g=acc Y",
            "accel_z_g=acc Z (g)"
        ]
    );
    // Two that say two units: nobody knows that of the third.
    assert_eq!(of_header("t,gyro x [rad/s],gyro y [deg/s],gyro z", ',')[3], "gyro_z=gyro z");
}

#[test]
fn a_time_in_two_columns_is_that_of_its_whole_seconds() {
    let of = |header: &str, rest: [u64; 3]| {
        let row = |k: usize| format!("{k},1777713260,{},0.1", rest[k]);
        chosen(&format!("{header}\n{}\n{}\n{}\n", row(0), row(1), row(2)))
    };
    for (header, rest) in [
        ("Time,header.stamp.secs,header.stamp.nsecs,gz", [990_000_000, 995_000_000, 999_000_000]),
        ("seq,sec,msec,gz", [120, 140, 160]),
        ("seq,t_sec,t_usec,gz", [120_000, 140_000, 160_000]),
    ] {
        assert_eq!(of(header, rest)[0], format!("t={}", header.split(',').nth(1).unwrap()), "{header}");
    }
    // A counter of milliseconds since the start is a time of its own.
    assert_eq!(of("seq,sec,ms,gz", [5_000, 5_010, 5_020])[0], "t_ms=ms");
}

#[test]
fn tum_trajectories() {
    let text = "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n1305031098.6659 1.3 0.6 1.6 0.1 0.2 0.3 0.9\n1305031098.6758 1.3 0.6 1.6 0.1 0.2 0.3 0.9\n";
    assert_eq!(chosen(text), ["t=timestamp", "ref_qw=qw", "ref_qx=qx", "ref_qy=qy", "ref_qz=qz"]);
}

#[test]
fn betaflight_counts_degrees() {
    let map = of_header(
        "loopIteration,time (us),axisP[0],gyroADC[0],gyroADC[1],gyroADC[2],accSmooth[0],vbatLatest (V),motor[0]",
        ',',
    );
    assert_eq!(map[..2], ["t_us=time (us)", "gyro_x_dps=gyroADC[0]"]);
    assert!(map.contains(&"supply=vbatLatest (V)".to_owned()), "{map:?}");
}

#[test]
fn xsens_has_a_clock_of_its_own_and_a_filter() {
    let text = "// Start Time: Unknown\n// Sample rate: 100.0Hz\nPacketCounter\tSampleTimeFine\tGyr_X\tGyr_Y\tGyr_Z\tQuat_q0\tQuat_q1\tQuat_q2\tQuat_q3\n\
        1\t1000\t0.1\t0.2\t0.3\t1\t0\t0\t0\n2\t1100\t0.1\t0.2\t0.3\t1\t0\t0\t0\n";
    assert_eq!(chosen(text)[..2], ["t_us=100*SampleTimeFine", "gyro_x=Gyr_X"]);
    assert!(proposal(text).dependence("Quat_q2").is_some());
}

#[test]
fn phones() {
    let phyphox = "\"Time (s)\"\t\"Gyroscope x (rad/s)\"\t\"Gyroscope y (rad/s)\"\t\"Gyroscope z (rad/s)\"\t\"Absolute (rad/s)\"\n\
        0,01\t0,1\t0,2\t0,3\t0,4\n0,02\t0,1\t0,2\t0,3\t0,4\n";
    assert_eq!(chosen(phyphox)[..2], ["t=Time (s)", "gyro_x=Gyroscope x (rad/s)"]);
    // Bare letters say nothing of what they are.
    let logger =
        "time,seconds_elapsed,z,y,x\n1643981665000000000,0.01,0.1,0.2,0.3\n1643981665010000000,0.02,0.1,0.2,0.3\n";
    assert_eq!(chosen(logger), ["t=seconds_elapsed"]);
    let own = "time,seconds_elapsed,qz,qy,qx,qw,roll,pitch,yaw\n1643981665000000000,0.01,0,0,0,1,0,0,0\n1643981665010000000,0.02,0,0,0,1,0,0,0\n";
    assert!(proposal(own).dependence("qz").is_some_and(|by| by.contains("phone")));
}

#[test]
fn a_time_whose_name_has_no_unit_is_in_the_one_that_gives_10_hz_to_10_khz() {
    for (first, step, unit) in [
        // Since a phone's start, nine days ago: as large as seconds of 1995.
        (801_439_402.0, 10.0, "t_ms"),
        (801_439_402.0, 2.0, "t_ms"),
        (1_741_275_913.0, 1.0, "t"),
        (1_741_275_913.25, 0.25, "t"),
        // Means over 15 s, of 2025.
        (1_741_275_913.0, 15.0, "t"),
        // 10 Hz and 10 kHz are both in the range.
        (0.1, 0.1, "t"),
        (100.0, 100.0, "t_ms"),
        (0.0, 0.005, "t"),
        (0.0, 5.0, "t_ms"),
        (0.0, 125.0, "t_us"),
        (0.0, 5000.0, "t_us"),
        (0.0, 5e6, "t_ns"),
    ] {
        let row = |k: i32| format!("{},0.{}\n", first + step * f64::from(k), 1 + k);
        let text = format!("Time,gyro_z\n{}{}{}", row(0), row(1), row(2));
        assert_eq!(chosen(&text)[0], format!("{unit}=Time"), "{text}");
    }
}

#[test]
fn ros_and_px4_as_csv() {
    let ros = "%time,field.header.seq,field.header.stamp,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z\n\
        1400000000000000000,1,1400000000000000000,0.1,0.2,0.3\n1400000000005000000,2,1400000000005000000,0.1,0.2,0.3\n";
    assert_eq!(chosen(ros)[..2], ["t_ns=field.header.stamp", "gyro_x=field.angular_velocity.x"]);
    let px4 = "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt\n1000000,0.1,0.2,0.3,4000\n1004000,0.1,0.2,0.3,4000\n";
    assert_eq!(chosen(px4), ["t_us=timestamp", "gyro_x=gyro_rad[0]", "gyro_y=gyro_rad[1]", "gyro_z=gyro_rad[2]"]);
}

#[test]
fn a_second_imu_is_offered_and_an_encoder_is_taken() {
    let text = "time,imu1_gyro_z_dps,imu2_gyro_z_dps,encoder_z [deg],yaw [deg]\n0.00,1,2,3,4\n0.01,1,2,3,4\n";
    let found = proposal(text);
    let flags = |picks: &[log_readers::meaning::Pick]| picks.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert_eq!(flags(&found.chosen), ["t=time", "gyro_z_dps=imu1_gyro_z_dps", "ref_angle_z_deg=encoder_z [deg]"]);
    assert_eq!(flags(&found.offered), ["ref_rate_z_dps=imu2_gyro_z_dps"]);
}

#[test]
fn what_is_commanded_is_no_measurement() {
    assert_eq!(
        chosen("t,gyro_z,angle_setpoint_z [deg],cmd_z [deg]\n0.00,1,2,3\n0.01,1,2,3\n"),
        ["t=t", "gyro_z=gyro_z"]
    );
}
