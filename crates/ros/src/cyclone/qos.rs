//! Quality of service in the library's representation.

use std::ffi::{CStr, c_void};
use std::ptr;
use std::time::Duration;

use cyclors as c;
use teampulse_core::qos::{Durability, History, Liveliness, Qos, Reliability};

/// How long a reliable publisher blocks on a slow subscriber before it fails [ns].
const MAX_BLOCKING_NS: i64 = 1_000_000_000;
/// The library's value for infinity [ns].
const INFINITE_NS: i64 = i64::MAX;

/// An owned set of policies.
pub(super) struct Policies(*mut c::dds_qos_t);

impl Policies {
    /// The policies of one of our endpoints: this QoS and user data, plain CDR as in ROS 2, ignoring our own
    /// participant.
    pub(super) fn new(qos: &Qos, user_data: &str) -> Policies {
        // SAFETY: the library returns a set that we own, and copies all values set in it.
        unsafe {
            let policies = Policies(c::dds_create_qos());
            policies.set_delivery(qos);
            policies.set_times(qos);
            let plain = [c::DDS_DATA_REPRESENTATION_XCDR1 as c::dds_data_representation_id_t];
            c::dds_qset_data_representation(policies.0, 1, plain.as_ptr());
            let own = c::dds_ignorelocal_kind_DDS_IGNORELOCAL_PARTICIPANT;
            c::dds_qset_ignorelocal(policies.0, own);
            c::dds_qset_writer_data_lifecycle(policies.0, false);
            // Our type has no representation for shared memory.
            c::dds_qset_psmx_instances(policies.0, 0, ptr::null_mut());
            let (bytes, size) = (user_data.as_ptr().cast::<c_void>(), user_data.len());
            c::dds_qset_userdata(policies.0, bytes, size);
            policies
        }
    }

    pub(super) fn as_ptr(&self) -> *const c::dds_qos_t {
        self.0
    }

    unsafe fn set_delivery(&self, qos: &Qos) {
        let (history, depth) = match qos.history {
            History::KeepLast(depth) => {
                let depth = i32::try_from(depth.max(1)).unwrap_or(i32::MAX);
                (c::dds_history_kind_DDS_HISTORY_KEEP_LAST, depth)
            }
            History::KeepAll => (c::dds_history_kind_DDS_HISTORY_KEEP_ALL, c::DDS_LENGTH_UNLIMITED),
        };
        let reliability = match qos.reliability {
            Reliability::BestEffort => c::dds_reliability_kind_DDS_RELIABILITY_BEST_EFFORT,
            Reliability::Reliable => c::dds_reliability_kind_DDS_RELIABILITY_RELIABLE,
        };
        let durability = match qos.durability {
            Durability::Volatile => c::dds_durability_kind_DDS_DURABILITY_VOLATILE,
            Durability::TransientLocal => c::dds_durability_kind_DDS_DURABILITY_TRANSIENT_LOCAL,
        };
        let unlimited = c::DDS_LENGTH_UNLIMITED;
        // SAFETY: the set is ours and valid. The history for late joiners is a separate policy, so the depth is set
        // twice.
        unsafe {
            c::dds_qset_history(self.0, history, depth);
            c::dds_qset_reliability(self.0, reliability, MAX_BLOCKING_NS);
            c::dds_qset_durability(self.0, durability);
            c::dds_qset_durability_service(
                self.0, 0, history, depth, unlimited, unlimited, unlimited,
            );
        }
    }

    unsafe fn set_times(&self, qos: &Qos) {
        let liveliness = match qos.liveliness {
            Liveliness::Automatic => c::dds_liveliness_kind_DDS_LIVELINESS_AUTOMATIC,
            Liveliness::ManualByTopic => c::dds_liveliness_kind_DDS_LIVELINESS_MANUAL_BY_TOPIC,
        };
        // SAFETY: the set is ours and valid.
        unsafe {
            c::dds_qset_deadline(self.0, nanos(qos.deadline));
            c::dds_qset_lifespan(self.0, nanos(qos.lifespan));
            c::dds_qset_liveliness(self.0, liveliness, nanos(qos.liveliness_lease));
        }
    }
}

impl Drop for Policies {
    fn drop(&mut self) {
        // SAFETY: the set is ours, and is deleted only here.
        unsafe { c::dds_delete_qos(self.0) };
    }
}

/// Reads a property of a participant; `None` if it is empty or missing.
///
/// # Safety
///
/// `policies` is null or a valid set.
pub(super) unsafe fn property(policies: *const c::dds_qos_t, name: &CStr) -> Option<String> {
    if policies.is_null() {
        return None;
    }
    let mut value = ptr::null_mut();
    // SAFETY: the caller guarantees a valid set. The library returns a copy that we must free, or leaves
    // null.
    unsafe {
        if !c::dds_qget_prop(policies, name.as_ptr(), &raw mut value) || value.is_null() {
            return None;
        }
        let text = CStr::from_ptr(value).to_string_lossy().into_owned();
        c::dds_free(value.cast());
        Some(text).filter(|text| !text.trim().is_empty())
    }
}

/// Reads the QoS that an endpoint offers or requests, and its user data.
///
/// # Safety
///
/// `policies` is null or a valid set.
pub(super) unsafe fn read(policies: *const c::dds_qos_t) -> (Qos, Vec<u8>) {
    let mut qos = Qos::best_effort(1);
    if policies.is_null() {
        return (qos, Vec::new());
    }
    let (mut kind, mut depth, mut period_ns) = (0, 1, INFINITE_NS);
    // SAFETY: the caller guarantees a valid set, and all outputs are ours. A policy that is not in the set
    // leaves its output unchanged.
    unsafe {
        if c::dds_qget_reliability(policies, &raw mut kind, ptr::null_mut())
            && kind == c::dds_reliability_kind_DDS_RELIABILITY_RELIABLE
        {
            qos.reliability = Reliability::Reliable;
        }
        if c::dds_qget_durability(policies, &raw mut kind)
            && kind >= c::dds_durability_kind_DDS_DURABILITY_TRANSIENT_LOCAL
        {
            qos.durability = Durability::TransientLocal;
        }
        if c::dds_qget_history(policies, &raw mut kind, &raw mut depth) {
            let all = kind == c::dds_history_kind_DDS_HISTORY_KEEP_ALL;
            let last = History::KeepLast(u32::try_from(depth).unwrap_or(0));
            qos.history = if all { History::KeepAll } else { last };
        }
        if c::dds_qget_deadline(policies, &raw mut period_ns) {
            qos.deadline = duration(period_ns);
        }
        if c::dds_qget_lifespan(policies, &raw mut period_ns) {
            qos.lifespan = duration(period_ns);
        }
        if c::dds_qget_liveliness(policies, &raw mut kind, &raw mut period_ns) {
            qos.liveliness_lease = duration(period_ns);
            if kind == c::dds_liveliness_kind_DDS_LIVELINESS_MANUAL_BY_TOPIC {
                qos.liveliness = Liveliness::ManualByTopic;
            }
        }
        (qos, user_data(policies))
    }
}

/// # Safety
///
/// `policies` is a valid set.
unsafe fn user_data(policies: *const c::dds_qos_t) -> Vec<u8> {
    let (mut bytes, mut size) = (ptr::null_mut::<c_void>(), 0);
    // SAFETY: the library returns a copy of `size` bytes, or null; we must free the copy.
    unsafe {
        if !c::dds_qget_userdata(policies, &raw mut bytes, &raw mut size) || bytes.is_null() {
            return Vec::new();
        }
        let read = std::slice::from_raw_parts(bytes.cast::<u8>(), size).to_vec();
        c::dds_free(bytes);
        read
    }
}

/// The ROS name of a policy id of the library.
pub(super) fn policy_name(id: u32) -> String {
    let name = match id {
        c::dds_qos_policy_id_DDS_DURABILITY_QOS_POLICY_ID => "durability",
        c::dds_qos_policy_id_DDS_DEADLINE_QOS_POLICY_ID => "deadline",
        c::dds_qos_policy_id_DDS_LIVELINESS_QOS_POLICY_ID => "liveliness",
        c::dds_qos_policy_id_DDS_RELIABILITY_QOS_POLICY_ID => "reliability",
        c::dds_qos_policy_id_DDS_HISTORY_QOS_POLICY_ID => "history",
        c::dds_qos_policy_id_DDS_LIFESPAN_QOS_POLICY_ID => "lifespan",
        c::dds_qos_policy_id_DDS_PARTITION_QOS_POLICY_ID => "partition",
        c::dds_qos_policy_id_DDS_OWNERSHIP_QOS_POLICY_ID => "ownership",
        c::dds_qos_policy_id_DDS_PRESENTATION_QOS_POLICY_ID => "presentation",
        c::dds_qos_policy_id_DDS_DATA_REPRESENTATION_QOS_POLICY_ID => "data representation",
        other => return format!("policy {other}"),
    };
    name.to_owned()
}

fn nanos(period: Option<Duration>) -> i64 {
    period.and_then(|period| i64::try_from(period.as_nanos()).ok()).unwrap_or(INFINITE_NS)
}

fn duration(period_ns: i64) -> Option<Duration> {
    let finite = (0..INFINITE_NS).contains(&period_ns);
    finite.then(|| Duration::from_nanos(period_ns.unsigned_abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn policies_come_back_as_they_were() {
        let mut all = vec![Qos::reliable(10), Qos::best_effort(5), Qos::latched(1000)];
        all.push(Qos { history: History::KeepAll, ..Qos::reliable(1) });
        all.push(Qos {
            deadline: Some(Duration::from_millis(100)),
            lifespan: Some(Duration::from_secs(2)),
            liveliness: Liveliness::ManualByTopic,
            liveliness_lease: Some(Duration::from_secs(1)),
            ..Qos::latched(3)
        });
        for qos in all {
            let policies = Policies::new(&qos, "typehash=x;");
            // SAFETY: the set is valid until the end of the block.
            let (read, user_data) = unsafe { read(policies.as_ptr()) };
            assert_eq!((read, user_data), (qos, b"typehash=x;".to_vec()));
        }
    }

    #[test]
    fn no_policies_read_as_the_least_that_can_be_offered() {
        // SAFETY: null is allowed.
        assert_eq!(unsafe { read(ptr::null()) }, (Qos::best_effort(1), Vec::new()));
    }
}
