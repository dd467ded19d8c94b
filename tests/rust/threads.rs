//! The public types of every library crate may move to another thread and be shared between
//! threads, but for a log's writer: a field that forbids it breaks every program that does so, and
//! this test.

use std::fs::File;
use std::io::BufWriter;

const fn is_shareable<T: Send + Sync>() {}

const fn is_movable<T: Send>() {}

#[test]
fn public_types_are_send_and_sync() {
    is_shareable::<tactid_dynamics::Manipulator>();
    is_shareable::<tactid_dynamics::Urdf>();
    is_shareable::<tactid_dynamics::Workspace>();
    is_shareable::<tactid_nlms::Lms<10>>();
    is_shareable::<tactid_nlms::Nlms<10>>();
    is_shareable::<tactid_nlms::Rls<10>>();
    is_shareable::<tactid_nlms::ChangeDetector>();
    is_shareable::<tactid_batch::BatchIdentifier>();
    is_shareable::<tactid_batch::BatchResult>();
    is_shareable::<tactid_identify::EquationStream>();
    is_shareable::<tactid_identify::Identifier>();
    is_shareable::<tactid_identify::IdentifyError>();
    is_shareable::<tactid_recordings::PaperFilter>();
    is_shareable::<tactid_identify::PayloadEstimate>();
    is_shareable::<tactid_logs::LogError>();
    is_shareable::<tactid_logs::LogReader>();
    is_shareable::<tactid_recordings::ArmCalibration>();
    is_shareable::<tactid_recordings::RecordingError>();
    is_shareable::<tactid_recordings::Request>();
    is_shareable::<tactid_excitation::DesignSettings>();
    is_shareable::<tactid_excitation::Problem>();
    is_shareable::<tactid_sim::Experiment>();
}

/// A log has one writer at a time, and the library of the format does not let its writer be shared.
#[test]
fn a_writer_moves_to_another_thread() {
    is_movable::<tactid_logs::LogWriter<BufWriter<File>>>();
}
