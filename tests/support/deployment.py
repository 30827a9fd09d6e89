"""The authority of a deployment and the credentials of its members, made in a folder of a test."""

import datetime
from pathlib import Path

from crcolony_deploy.authority import Authority, AuthoritySettings
from crcolony_deploy.member_folder import Applicant, install_grant, request_membership

from crcolony.protocol.identity import Identity, create_key
from crcolony.protocol.roster import Role
from crcolony.storage.files import KEY_FILE


class Deployment:
    """A colony with an authority; nothing here opens a connection."""

    def __init__(self, folder: Path, colony: str = "colony", lifetime_h: float = 24.0) -> None:
        self.folder, self.colony = folder, colony
        Authority.create(folder / "authority", AuthoritySettings(colony, lifetime_h))
        self.applicants: dict[Path, Applicant] = {}

    @property
    def authority(self) -> Authority:
        """The authority as it is now: commands change it, too."""
        return Authority.load(self.folder / "authority")

    def member(
        self, role: Role, name: str, *robots: Identity, arenas: tuple[str, ...] = ()
    ) -> Path:
        """Admit a member; return the folder of its credentials."""
        credentials = self.folder / f"{role}.{name}"
        self.applicants[credentials] = Applicant(role, name, robots, arenas)
        self.renew(credentials)
        return credentials

    def robot(self, name: str) -> tuple[Path, Path]:
        """Admit a robot with a new key; return its folder and that of its credentials."""
        folder = self.folder / name
        return folder, self.member("robot", name, create_key(folder / KEY_FILE))

    def renew(self, credentials: Path, lifetime: datetime.timedelta | None = None) -> None:
        """Give a member its next certificate, with another lifetime if one is given."""
        request = request_membership(credentials, self.applicants[credentials])
        authority = self.authority
        if lifetime is not None:
            hours = lifetime.total_seconds() / 3600.0
            authority.settings = AuthoritySettings(self.colony, hours)
        install_grant(credentials, authority.admit(request))

    def distribute_roster(self) -> None:
        """Write the newest roster into the folders of all members, as if it had reached them all."""
        for credentials in self.applicants:
            (credentials / "roster").write_bytes(self.authority.signed_roster)
